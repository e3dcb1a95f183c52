#include "server/text/toml_shape.h"

#include <gtest/gtest.h>

#include "server/config/config.h"
#include "server/scene/scene_file.h"

namespace hapticd::server {
namespace {

std::string repeated(std::string_view text, std::size_t times) {
  std::string all;
  for (std::size_t i = 0; i < times; ++i) all += text;
  return all;
}

/// A key of so many parts.
std::string key(std::size_t parts) {
  return repeated("a.", parts - 1) + "a";
}

void expect_too_many_parts(const std::string& text, const std::string& line) {
  const auto error = check_toml_shape(text, "scene text");
  ASSERT_TRUE(error) << text.substr(0, 80);
  EXPECT_EQ(error->what, "a key has too many parts");
  EXPECT_EQ(error->where, "scene text, line " + line);
  EXPECT_EQ(error->limit, "at most 16 parts joined by dots");
}

TEST(TomlShape, RefusesKeysOfTooManyPartsInEveryPlaceAKeyCanStand) {
  for (const std::size_t parts : {std::size_t{17}, std::size_t{32171}}) {
    expect_too_many_parts(key(parts) + " = 1\n", "1");
    expect_too_many_parts("name = \"x\"\n[" + key(parts) + "]\n", "2");
    expect_too_many_parts("\n\n[[" + key(parts) + "]]\n", "3");
    expect_too_many_parts("t = { b = 1, " + key(parts) + " = 1 }\n", "1");
    expect_too_many_parts("x = \"\"\"\n[.\n\"\"\"\n" + key(parts) + " = 1\n", "4");
  }
  expect_too_many_parts(repeated("\"q.\" . ", 16) + "b = 1\n", "1");
  expect_too_many_parts(repeated("'q' .\t", 16) + "b = 1\n", "1");
}

TEST(TomlShape, CountsNoDotsThatAreNoKey) {
  const std::string dots(2000, '.');
  for (const std::string& text :
       {key(16) + " = 1\n", "[" + key(16) + "]\n" + key(16) + " = 1\n", "s = \"" + dots + "\"\n",
        "s = \"a\\\"" + dots + "\"\n", "s = '" + dots + "'\n", "s = '\\'\nt = '" + dots + "'\n",
        "# " + dots + "\n", "s = \"\"\"\n" + dots + "\n\"" + dots + "\n\"\"\"\"\"\n",
        "s = '''\n''" + dots + "'''\n", "n = [" + repeated("1.5, ", 500) + "2.5]\n",
        std::string("t = 1979-05-27T00:32:00.999999\n"), std::string(), std::string("\"")}) {
    const auto error = check_toml_shape(text, "scene text");
    EXPECT_FALSE(error) << error->text() << "\n" << text.substr(0, 80);
  }
}

TEST(TomlShape, RefusesLinesThatAreTooLongWhereverTheyStand) {
  const std::string longer(kMaxTomlLine + 1, 'x');
  for (const std::string& text :
       {longer, "s = \"" + longer, "s = '" + longer + "'", "# " + longer, "s = \"\"\"" + longer + "\"\"\"",
        "n = [" + repeated("1,", kMaxTomlLine) + "]"}) {
    const auto error = check_toml_shape("a = 1\n" + text, "rig.toml");
    ASSERT_TRUE(error) << text.substr(0, 20);
    EXPECT_EQ(error->what, "a line is too long");
    EXPECT_EQ(error->where, "rig.toml, line 2");
    EXPECT_EQ(error->limit, "at most 16384 bytes");
  }
  EXPECT_FALSE(check_toml_shape(repeated("# one of many lines\n", 50000), "rig.toml"));
}

// 62 kB of one dotted key used up the stack of the one who parsed it.
TEST(TomlShape, StandsBeforeScenesAndConfigurations) {
  const std::string deep = repeated("a.", 32171) + "a = 1\n";
  const auto scene = parse_scene("name = \"x\"\n" + deep, "scene text");
  ASSERT_FALSE(scene);
  EXPECT_EQ(scene.error().what, "a key has too many parts");
  EXPECT_EQ(scene.error().where, "scene text, line 2");
  const auto config = parse_config(deep, "hapticd.toml");
  ASSERT_FALSE(config);
  EXPECT_EQ(config.error().what, "a key has too many parts");
}

}  // namespace
}  // namespace hapticd::server
