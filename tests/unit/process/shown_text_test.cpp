#include <gtest/gtest.h>

#include "proto/text/json_depth.h"
#include "proto/text/utf8_text.h"

namespace hapticd::text {
namespace {

TEST(ShownText, EscapesWhatATerminalWouldObey) {
  EXPECT_EQ(printable("\x1b]0;title\x07\x1b[2J"), "\\u001b]0;title\\u0007\\u001b[2J");
  EXPECT_EQ(printable("one\r\ntwo\tthree"), "one\\r\\ntwo\\tthree");
  EXPECT_EQ(printable("\x7f\xc2\x80\xc2\x9b\xc2\x9f\xc2\x85"), "\\u007f\\u0080\\u009b\\u009f\\u0085");
  EXPECT_EQ(printable(std::string_view("a\0b", 3)), "a\\u0000b");
}

TEST(ShownText, EscapesWhatWouldReorderOrBreakALine) {
  EXPECT_EQ(printable("\u061c\u200e\u200f\u2028\u2029\u202a\u202e\u2066\u2069"),
            "\\u061c\\u200e\\u200f\\u2028\\u2029\\u202a\\u202e\\u2066\\u2069");
}

TEST(ShownText, LeavesEverythingElseAsItIs) {
  const std::string plain = "µN, 力, 🖐, \u00a0 \u200d \u2027 \u2030 \u2065 \u206a \\n \"quoted\"";
  EXPECT_EQ(printable(plain), plain);
}

TEST(ShownText, ReplacesWhatIsNotUtf8) {
  EXPECT_EQ(printable("a\x9b"
                      "2J\xff\xfe"),
            "a\uFFFD2J\uFFFD\uFFFD");
  EXPECT_EQ(printable("\xc0\x9b\xe0\x82\x9b"), "\uFFFD\uFFFD\uFFFD\uFFFD\uFFFD")
      << "overlong forms of controls";
}

TEST(ShownText, ADocumentKeepsItsLines) {
  EXPECT_EQ(printable_lines("a = 1\n\tb = \"\x1b\"\r\n"), "a = 1\n\tb = \"\\u001b\"\\r\n");
}

std::string nested(std::size_t depth, char open = '[', char close = ']') {
  return std::string(depth, open) + std::string(depth, close);
}

TEST(JsonDepth, CountsBracketsWithinBrackets) {
  EXPECT_TRUE(is_shallow_json(""));
  EXPECT_TRUE(is_shallow_json(nested(kMaxJsonDepth)));
  EXPECT_FALSE(is_shallow_json(nested(kMaxJsonDepth + 1)));
  EXPECT_FALSE(is_shallow_json(nested(kMaxJsonDepth + 1, '{', '}')));
  EXPECT_FALSE(is_shallow_json(std::string(65'000, '[')));
}

TEST(JsonDepth, CountsNoneBesideOneAnother) {
  std::string row;
  for (int i = 0; i < 1000; ++i) row += "[],{},";
  EXPECT_TRUE(is_shallow_json("[" + row + "0]"));
  EXPECT_TRUE(is_shallow_json(std::string(100, ']') + nested(kMaxJsonDepth)));
}

TEST(JsonDepth, CountsNoneInATextButThoseBehindIt) {
  const std::string many(100, '[');
  EXPECT_TRUE(is_shallow_json("\"" + many + "\""));
  EXPECT_TRUE(is_shallow_json(R"("\")" + many + "\""));
  EXPECT_FALSE(is_shallow_json(R"("\\")" + many));
}

}  // namespace
}  // namespace hapticd::text
