#include "proto/text/toml_shape.h"

#include <gtest/gtest.h>

#include "server/text/toml_reader.h"
#include "tests/support/refusals.h"
#include "tests/support/texts.h"

namespace hapticd::server {
namespace {

using text::check_toml_shape;
using text::kMaxTomlItems;
using text::kMaxTomlLine;

using test::repeated;

/// A key of so many parts.
std::string key(std::size_t parts) {
  return repeated("a.", parts - 1) + "a";
}

/// The shape as every file is read, whether or not the rest is TOML.
hal::Result<bool> shape_of(const std::string& text) {
  const auto document = TomlDocument::parse(text, "scene text");
  if (!document && document.error().code != hal::ErrorCode::kSyntax) return document.error();
  return true;
}

TEST(TomlShape, RefusesKeysOfTooManyPartsInEveryPlaceAKeyCanStand) {
  using enum hal::ErrorCode;
  const std::string too_many = "a key has too many parts";
  for (const std::size_t parts : {std::size_t{17}, std::size_t{32171}}) {
    test::expect_refusals(
        {
            {key(parts) + " = 1\n", too_many, kTooLong, 1},
            {"name = \"x\"\n[" + key(parts) + "]\n", too_many, kTooLong, 2},
            {"\n\n[[" + key(parts) + "]]\n", too_many, kTooLong, 3},
            {"t = { b = 1, " + key(parts) + " = 1 }\n", too_many, kTooLong, 1},
            {"x = \"\"\"\n[.\n\"\"\"\n" + key(parts) + " = 1\n", too_many, kTooLong, 4},
        },
        shape_of);
  }
  test::expect_refusals({{repeated("\"q.\" . ", 16) + "b = 1\n", too_many, kTooLong, 1},
                         {repeated("'q' .\t", 16) + "b = 1\n", too_many, kTooLong, 1}},
                        shape_of);
  EXPECT_EQ(shape_of(key(17) + " = 1\n").error().limit, "at most 16 parts joined by dots");
}

TEST(TomlShape, CountsNoDotsThatAreNoKey) {
  const std::string dots(2000, '.');
  for (const std::string& text :
       {key(16) + " = 1\n", "[" + key(16) + "]\n" + key(16) + " = 1\n", "s = \"" + dots + "\"\n",
        "s = \"a\\\"" + dots + "\"\n", "s = '" + dots + "'\n", "s = '\\'\nt = '" + dots + "'\n",
        "# " + dots + "\n", "s = \"\"\"\n" + dots + "\n\"" + dots + "\n\"\"\"\"\"\n",
        "s = '''\n''" + dots + "'''\n", "n = [" + repeated("1.5, ", 500) + "2.5]\n",
        std::string("t = 1979-05-27T00:32:00.999999\n"), std::string(), std::string("\"")}) {
    const auto problem = check_toml_shape(text);
    EXPECT_FALSE(problem) << problem->what << "\n" << text.substr(0, 80);
  }
}

TEST(TomlShape, RefusesLinesThatAreTooLongWhereverTheyStand) {
  using enum hal::ErrorCode;
  const std::string longer(kMaxTomlLine + 1, 'x');
  for (const std::string& text :
       {longer, "s = \"" + longer, "s = '" + longer + "'", "# " + longer, "s = \"\"\"" + longer + "\"\"\"",
        "n = [" + repeated("1,", kMaxTomlLine) + "]"}) {
    test::expect_refusals({{"a = 1\n" + text, "a line is too long", kTooLong, 2}}, shape_of);
  }
  EXPECT_FALSE(check_toml_shape(repeated("# one of many lines\n", 50000)));
}

TEST(TomlShape, RefusesTooManyKeysAndValuesHoweverTheyAreWritten) {
  const std::size_t limit = kMaxTomlItems;
  for (const std::string& text :
       {repeated("a=1\n", limit + 1), repeated("[a]\n", limit + 1), repeated("[[a]]\n", limit / 2 + 1),
        repeated(key(16) + "=1\n", limit / 16 + 1), "a = [\n" + repeated("1,\n", limit + 1) + "]\n",
        "a = [\n" + repeated("[],\n", limit / 2 + 1) + "]\n",
        "a = [\n" + repeated("{b=1},\n", limit / 2 + 1) + "]\n"}) {
    const auto shape = shape_of(text);
    ASSERT_FALSE(shape) << text.substr(0, 20);
    EXPECT_EQ(shape.error().code, hal::ErrorCode::kTooLong);
    EXPECT_EQ(shape.error().what, "the text holds too many keys and values");
    EXPECT_EQ(shape.error().limit, "at most 10000");
  }
  EXPECT_EQ(shape_of("[t]\n" + repeated("a=1\n", limit)).error().where, "scene text, line 10001");
}

TEST(TomlShape, CountsKeysAndValuesAndNothingElse) {
  for (const std::string& text :
       {repeated("a=1\n", kMaxTomlItems),
        "heights = [\n" + repeated("-12.5, 0.25,\n", 2048) + "]\n",  // of the largest surface
        "s = '''\n" + repeated("a = [1, 2]\n", kMaxTomlItems) + "'''\n",
        repeated("# a = [1, 2]\n", kMaxTomlItems), repeated("\n", 10 * kMaxTomlItems)}) {
    const auto problem = check_toml_shape(text);
    EXPECT_FALSE(problem) << problem->what;
  }
}

// The library holds these impossible (proto/text/toml_library.h): an assertion would end the program.
TEST(TomlShape, WhatTheLibraryHoldsImpossibleIsASyntaxError) {
  for (const std::string text : {"[{", "a = [}", "[a]\nserver = [}", "\xEF\xBA\xBF", "a = \xEF\xBA\xBF\n",
                                 "[a]\xEF\xBA\xBF\nserver = \"x:1\"\n"}) {
    const auto document = TomlDocument::parse(text, "scene text");
    ASSERT_FALSE(document) << text;
    EXPECT_EQ(document.error().code, hal::ErrorCode::kSyntax) << text;
  }
}

TEST(TomlSyntax, SaysThatADecimalMarkIsAPoint) {
  const auto remedy_of = [](const char* text) {
    return TomlDocument::parse(text, "scene text").error().remedy;
  };
  EXPECT_EQ(remedy_of("name = \"x\"\n[target]\nstiffness_n_per_mm = 0,5\n"),
            "write a decimal point, not a comma");
  EXPECT_EQ(remedy_of("a = 0,"), "correct the syntax");
  EXPECT_EQ(remedy_of("a = \"x\", b = 1"), "correct the syntax");
  EXPECT_EQ(remedy_of("= 1,5"), "correct the syntax");
}

}  // namespace
}  // namespace hapticd::server
