#include "client/cli/text_table.h"

#include <gtest/gtest.h>

namespace hapticd::cli {
namespace {

TEST(TextTable, AlignsByWhatIsSeen) {
  TextTable table({"µs", "max"}, {TextTable::Align::kLeft, TextTable::Align::kRight});
  table.add({"wake-up", "4.5"});
  table.add({"\x1b[91mred\x1b[0m", "1234.5"});
  const auto lines = table.lines(Terminal{}, 1);
  EXPECT_EQ(lines[0], " µs          max");
  EXPECT_EQ(lines[1], " wake-up     4.5");
  EXPECT_EQ(lines[2], " \x1b[91mred\x1b[0m      1234.5");
}

TEST(Terminal, WidthsAreColumnsNotBytes) {
  EXPECT_EQ(display_width("±5 µm"), 5U);
  EXPECT_EQ(display_width("\x1b[1mab\x1b[0m"), 2U);
  EXPECT_EQ(padded("±5", 4), "±5  ");
  EXPECT_EQ(padded("µµµµ", 2), "µµ");
  EXPECT_EQ(padded_left("µ", 3), "  µ");
}

}  // namespace
}  // namespace hapticd::cli
