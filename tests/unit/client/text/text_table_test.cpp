#include "client/cli/text/text_table.h"

#include <gtest/gtest.h>

#include "client/cli/session/print.h"

namespace hapticd::cli {
namespace {

TEST(TextTable, AlignsByVisibleColumns) {
  TextTable table({"µs", "max"}, {TextTable::Align::kLeft, TextTable::Align::kRight});
  table.add({"wake-up", "4.5"});
  Terminal colored{.color = true};
  table.add({colored.paint(Color::kRed, "red"), "1234.5"});
  const auto lines = table.lines(Terminal{}, 1);
  EXPECT_EQ(lines[0], " µs          max");
  EXPECT_EQ(lines[1], " wake-up     4.5");
  EXPECT_EQ(for_terminal(lines[2]), " \x1b[91mred\x1b[0m      1234.5");
}

TEST(TextTable, ACellOfOthersStaysInItsPlace) {
  TextTable table;
  table.add({"a\nb\x1b[2J", "x"});
  table.add({"short", "y"});
  EXPECT_EQ(table.lines(Terminal{}), (std::vector<std::string>{"a\\nb\\u001b[2J  x", "short          y"}));
}

TEST(Print, OnlyTheProgramsOwnStylesBecomeEscapes) {
  Terminal colored{.color = true};
  const std::string evil =
      "\x1b[31m\x1b]0;t\x07\r\n\xc2\x9b"
      "2J\xe2\x80\xae\x7f";
  EXPECT_EQ(for_terminal(colored.bold(evil)),
            "\x1b[1m\\u001b[31m\\u001b]0;t\\u0007\\r\\n\\u009b2J\\u202e\\u007f\x1b[0m");
  EXPECT_EQ(for_terminal(std::string("a\xff")), "a") << "a mark without a style is nothing";
}

TEST(Terminal, WidthsAreColumnsNotBytes) {
  EXPECT_EQ(display_width("±5 µm"), 5U);
  Terminal colored{.color = true};
  EXPECT_EQ(display_width(colored.bold("ab")), 2U);
  EXPECT_EQ(padded(colored.bold("abc"), 2), colored.bold("ab"));
  EXPECT_EQ(padded("±5", 4), "±5  ");
  EXPECT_EQ(padded("µµµµ", 2), "µµ");
  EXPECT_EQ(padded_left("µ", 3), "  µ");
}

TEST(TextTable, BreaksItsLastColumnBetweenWordsWhereATerminalIsTooNarrow) {
  TextTable table;
  table.add({"memory", "what is said of it is longer than the terminal is wide"});
  table.add({"clock", "short"});
  Terminal terminal;
  EXPECT_EQ(table.lines(terminal).size(), 2U) << "no terminal: programs read whole lines";
  terminal.live = true;
  terminal.width = 36;
  const auto lines = table.lines(terminal);
  ASSERT_EQ(lines.size(), 3U);
  EXPECT_EQ(lines[0], "memory  what is said of it is longer");
  EXPECT_EQ(lines[1], "        than the terminal is wide");
  EXPECT_EQ(lines[2], "clock   short");
  for (const auto& line : lines) EXPECT_LE(display_width(line), 36U);
}

TEST(TextTable, LeavesALongWordWhole) {
  EXPECT_EQ(wrapped("a /very/long/path/that/has/no/blank b", 10),
            (std::vector<std::string>{"a", "/very/long/path/that/has/no/blank", "b"}));
  EXPECT_EQ(wrapped("", 10), std::vector<std::string>{""});
}

}  // namespace
}  // namespace hapticd::cli
