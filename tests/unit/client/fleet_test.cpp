// The list of rigs, and which of them --rigs means.

#include <gtest/gtest.h>

#include <string>
#include <utility>
#include <vector>

#include "client/cli/commands/commands.h"
#include "client/cli/fleet/rigs_file.h"
#include "tests/support/temporary_folder.h"
#include "tests/support/texts.h"
#include "tests/support/value_of.h"

namespace hapticd::cli {
namespace {

constexpr const char* kTwoRigs =
    "[right]\nserver = \"192.168.1.21:50051\"\ncertificates = \"/etc/right\"\n"
    "[left]\nserver = \"192.168.1.20:50051\"\nnote = \"room 12\"\n";

TEST(Rigs, AreReadByName) {
  const auto rigs = parse_rigs(kTwoRigs, "rigs.toml");
  ASSERT_EQ(rigs.size(), 2U);
  EXPECT_EQ(rigs[0].name, "left");
  EXPECT_EQ(rigs[0].server, "192.168.1.20:50051");
  EXPECT_EQ(rigs[0].note, "room 12");
  EXPECT_EQ(rigs[1].certificates, "/etc/right");
}

TEST(Rigs, AreChosenInTheOrderGiven) {
  const auto rigs = parse_rigs(kTwoRigs, "rigs.toml");
  const auto chosen = choose_rigs(rigs, "right,left", "rigs.toml");
  ASSERT_EQ(chosen.size(), 2U);
  EXPECT_EQ(chosen[0].name, "right");
  EXPECT_EQ(choose_rigs(rigs, "all", "rigs.toml").size(), 2U);
}

/// What the error says about the text or the choice.
v1::ErrorDetail refusal(const std::string& text, const std::string& names = "all") {
  try {
    choose_rigs(parse_rigs(text, "rigs.toml"), names, "rigs.toml");
  } catch (const LocalError& error) {
    return error.detail();
  }
  ADD_FAILURE() << "accepted: " << text;
  return {};
}

TEST(Rigs, MistakesAreNamedWithLineAndRemedy) {
  EXPECT_EQ(refusal("[a]\nserver = \"x:1\"\ncolour = \"red\"\n").where(), "rigs.toml, line 3");
  EXPECT_EQ(refusal("[a]\nnote = \"x\"\n").what(), "rig 'a' has no server");
  EXPECT_EQ(refusal("[a]\nserver = 5\n").what(), "'server' of rig 'a' is no text");
  EXPECT_EQ(refusal("[a]\nserver = \"x:1\\u0000y\"\n").limit(), "a text in quotes, without a zero byte");
  EXPECT_EQ(refusal("a = 1\n").what(), "'a' is no rig");
  EXPECT_EQ(refusal("[all]\nserver = \"x:1\"\n").what(), "a rig cannot have this name");
  EXPECT_NE(refusal("[a\n").what().find("not TOML"), std::string::npos);
  const v1::ErrorDetail unknown = refusal(kTwoRigs, "left,middle");
  EXPECT_EQ(unknown.value(), "middle");
  EXPECT_EQ(unknown.limit(), "left, right, all");
  EXPECT_EQ(refusal(kTwoRigs, ",").what(), "no rig has this name");
  EXPECT_EQ(refusal("# none yet\n").what(), "no rig is listed");
}

// The library holds these impossible (proto/text/toml_library.h): an assertion would end the program.
TEST(Rigs, WhatTheLibraryHoldsImpossibleIsNoToml) {
  for (const std::string text : {"[{", "a = [}", "[a]\nserver = [}", "\xEF\xBA\xBF", "a = \xEF\xBA\xBF\n",
                                 "[a]\xEF\xBA\xBF\nserver = \"x:1\"\n"}) {
    EXPECT_NE(refusal(text).what().find("not TOML"), std::string::npos) << text;
  }
}

// As configurations: the parser takes up to 500 bytes for a key of a few, and visits the parts of one
// recursively.
TEST(Rigs, AListThatWouldTakeTooMuchToParseIsRefused) {
  for (const auto& [text, what] : std::vector<std::pair<std::string, std::string>>{
           {test::repeated("[a]\n", 10001), "the text holds too many keys and values"},
           {test::repeated("a.", 30000) + "a = 1\n", "a key has too many parts"},
           {"# " + std::string(16384, 'x'), "a line is too long"}}) {
    const v1::ErrorDetail refused = refusal(text);
    EXPECT_EQ(refused.what(), what);
    EXPECT_TRUE(refused.where().starts_with("rigs.toml, line ")) << refused.where();
    EXPECT_TRUE(refused.limit().starts_with("at most ")) << refused.limit();
  }
}

TEST(Rigs, AFileThatIsTooLargeIsRefused) {
  const test::TemporaryFolder folder;
  const std::string rigs = test::repeated("# one of many lines\n", 52000) + kTwoRigs;
  EXPECT_EQ(read_rigs(folder.write("rigs.toml", rigs)).size(), 2U);
  const LocalError error = test::thrown_by<LocalError>([&] {
    read_rigs(folder.write("rigs.toml", test::repeated("# one of many lines\n", 53000) + kTwoRigs));
  });
  EXPECT_EQ(error.detail().what(), "the file is too large");
  EXPECT_EQ(error.detail().limit(), "at most 1 MiB");
}

TEST(Rigs, AFileThatIsMissingIsNamedWithItsForm) {
  const LocalError error = test::thrown_by<LocalError>([&] { read_rigs("/nowhere/rigs.toml"); });
  EXPECT_EQ(error.detail().where(), "/nowhere/rigs.toml");
  EXPECT_NE(error.detail().remedy().find("HAPTICD_RIGS"), std::string::npos);
}

TEST(Rigs, ACommandOfOneRigRefusesSeveral) {
  Session session{.server = "127.0.0.1:50051"};
  CLI::App app;
  build_app(app, session);
  EXPECT_THROW(app.parse("--rigs left,right clear"), LocalError);
}

}  // namespace
}  // namespace hapticd::cli
