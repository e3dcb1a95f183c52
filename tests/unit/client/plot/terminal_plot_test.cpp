#include "client/cli/plot/terminal_plot.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <string>

#include "client/cli/plot/braille_canvas.h"

namespace hapticd::cli {
namespace {

const Terminal kPlain{.unicode = true};
const Terminal kColored{.color = true, .unicode = true};
const Terminal kAscii{};

TEST(BrailleCanvas, EachDotHasItsPlaceInTheCell) {
  BrailleCanvas canvas(2, 1);
  EXPECT_EQ(canvas.row(0, kPlain), "  ");
  canvas.dot(0, 0, Color::kDefault);
  EXPECT_EQ(canvas.row(0, kPlain), "⠁ ");
  canvas.dot(3, 3, Color::kDefault);
  EXPECT_EQ(canvas.row(0, kPlain), "⠁⢀");
  for (int x = 0; x < 2; ++x) {
    for (int y = 0; y < 4; ++y) canvas.dot(x, y, Color::kDefault);
  }
  EXPECT_EQ(canvas.row(0, kPlain), "⣿⢀");
  EXPECT_EQ(canvas.row(0, kAscii), ":.");
}

TEST(BrailleCanvas, OutsideNothingHappens) {
  BrailleCanvas canvas(3, 2);
  canvas.line(-1000, -1000, 1000, -500, Color::kRed);
  canvas.dot(6, 0, Color::kRed);
  canvas.dot(0, 8, Color::kRed);
  EXPECT_EQ(canvas.row(0, kPlain) + canvas.row(1, kPlain), "      ");
}

TEST(BrailleCanvas, ColoursOnlyWhereTheTerminalShowsThem) {
  BrailleCanvas canvas(1, 1);
  canvas.dot(0, 0, Color::kRed);
  EXPECT_EQ(canvas.row(0, kPlain), "⠁");
  EXPECT_EQ(canvas.row(0, kColored), kColored.paint(Color::kRed, "⠁"));
  EXPECT_EQ(display_width(canvas.row(0, kColored)), 1U);
}

TEST(BrailleCanvas, ALineIsTheSameBothWays) {
  BrailleCanvas forth(8, 4);
  BrailleCanvas back(8, 4);
  forth.line(1, 2, 14, 2, Color::kDefault);
  back.line(14, 2, 1, 2, Color::kDefault);
  for (int row = 0; row < 4; ++row) EXPECT_EQ(forth.row(row, kPlain), back.row(row, kPlain));
}

TEST(Axis, TicksAreRoundAndWithin) {
  const auto found = ticks({-0.3, 2.0}, 6);
  ASSERT_EQ(found.size(), 5U);
  EXPECT_EQ(found.front().label, "0.0");
  EXPECT_EQ(found.back().label, "2.0");
  EXPECT_EQ(ticks({0.0, 0.0}, 5).size(), 0U);
  EXPECT_EQ(ticks({0.0, std::numeric_limits<double>::infinity()}, 5).size(), 0U);
}

TEST(Axis, HasTwoTicksAtLeast) {
  EXPECT_EQ(ticks({-0.5, 0.6}, 3).size(), 3U) << "-0.5, 0, 0.5; not 0 alone";
  for (const double high : {0.5, 0.6, 0.9, 1.0, 1.4, 3.0, 4.5, 7.0, 9.0, 12.0, 14.0, 45.0}) {
    for (const double low : {0.0, -0.1 * high, -0.45 * high}) {
      for (int count = 2; count <= 10; ++count) {
        EXPECT_GE(ticks({low, high}, count).size(), 2U) << low << " … " << high << ", " << count;
        EXPECT_LE(ticks({low, high}, count).size(), static_cast<std::size_t>(count) + 2);
      }
    }
  }
}

TEST(Axis, TicksAreBoundedFarFromZero) {
  for (const double low : {1e9, 1e15, 1e17, -1e17, 1e300}) {
    EXPECT_LE(ticks({low, std::nextafter(low, 1e308)}, 5).size(), 9U) << low;
  }
}

TEST(Axis, RoundedRangesHoldTheirValues) {
  const Range range = rounded({0.0, 2.03});
  EXPECT_EQ(range.low, 0.0);
  EXPECT_DOUBLE_EQ(range.high, 2.5);
  EXPECT_LT(rounded({3.0, 3.0}).low, 3.0);
  EXPECT_GT(rounded({3.0, 3.0}).high, 3.0);
  EXPECT_TRUE(std::isfinite(rounded({NAN, 1.0}).low));
}

TEST(TerminalPlot, EveryLineHasTheWidthAskedFor) {
  TerminalSeries wild{"wild",
                      Color::kRed,
                      TerminalSeries::Stroke::kLine,
                      {{-5.0, 1e300},
                       kBreak,
                       {0.5, NAN},
                       {0.2, 0.2},
                       {1e9, -1e9},
                       {0.0, std::numeric_limits<double>::infinity()}}};
  for (const Terminal& terminal : {kPlain, kColored, kAscii}) {
    for (const int width : {30, 80, 200}) {
      for (const int height : {8, 24}) {
        const auto lines = draw(
            {"displacement / mm", "force / N", {0.0, 1.0}, {-1.0, 1.0}, width, height},
            {wild, {"target", Color::kBlue, TerminalSeries::Stroke::kDashed, {{0, 0}, {1, 1}}}}, terminal);
        EXPECT_EQ(lines.size(), static_cast<std::size_t>(height));
        for (const auto& line : lines)
          EXPECT_EQ(display_width(line), static_cast<std::size_t>(width)) << line;
      }
    }
  }
}

TEST(TerminalPlot, ShowsUnitsLegendAndTicks) {
  const auto lines = draw({"displacement / mm", "force / N", {0.0, 10.0}, {0.0, 2.0}, 80, 20},
                          {{"hand", Color::kCyan, TerminalSeries::Stroke::kLine, {{0, 0}, {10, 2}}}}, kPlain);
  EXPECT_NE(lines.front().find("force / N"), std::string::npos);
  EXPECT_NE(lines.front().find("━━ hand"), std::string::npos);
  EXPECT_NE(lines.back().find("displacement / mm"), std::string::npos);
  EXPECT_NE(lines.back().find(" 2 "), std::string::npos);
  EXPECT_TRUE(lines[1].starts_with("2.0 ┤")) << lines[1];
  EXPECT_TRUE(lines[1].ends_with("⣀⠤⠒⠉")) << lines[1];
}

TEST(TerminalPlot, SideBySide) {
  EXPECT_EQ(side_by_side({"ab", "c"}, {"x"}, 2), (std::vector<std::string>{"ab  x", "c   "}));
}

}  // namespace
}  // namespace hapticd::cli
