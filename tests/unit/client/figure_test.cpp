#include "client/cli/figure.h"

#include <gtest/gtest.h>

#include <cmath>
#include <string>

namespace hapticd::cli {
namespace {

TEST(Figure, TheScriptHoldsItsDataUnitsAndNames) {
  Figure figure{.title = "a \"title\""};
  figure.panels.push_back({.x_label = "displacement / mm", .y_label = "force / N", .from_zero = true});
  figure.panels[0].series.push_back({.name = "hand", .points = {{0.0, 0.0}, {1.5, 0.6}, kBreak, {0.0, 1.0}}});
  const std::string script = gnuplot_script(figure, "out/it's.svg");
  EXPECT_NE(script.find("set output \"out/it's.svg\""), std::string::npos);
  EXPECT_NE(script.find("a \\\"title\\\""), std::string::npos);
  EXPECT_NE(script.find("$data_0_0 << EOD\n0 0\n1.5 0.6\n\n0 1\nEOD"), std::string::npos);
  EXPECT_NE(script.find("set xlabel \"displacement / mm\" offset 0,0"), std::string::npos);
  EXPECT_NE(script.find("title \"hand\""), std::string::npos);
}

TEST(Figure, AQuantityThatNeverChangesHasARange) {
  Figure figure;
  figure.panels.push_back({.x_label = "t"});
  figure.panels[0].series.push_back({.points = {{0.0, 3.0}, {1.0, 3.0}}});
  EXPECT_NE(gnuplot_script(figure, "x.svg").find("set yrange [2.5:3.5]"), std::string::npos);
}

TEST(Figure, ThinningKeepsEndsAndBreaks) {
  std::vector<Point> points;
  for (int i = 0; i < 1000; ++i) points.push_back({static_cast<double>(i), 0.0});
  points[501] = kBreak;
  const auto few = thinned(points, 100);
  EXPECT_LE(few.size(), 103U);
  EXPECT_EQ(few.front().x, 0.0);
  EXPECT_EQ(few.back().x, 999.0);
  EXPECT_EQ(std::count_if(few.begin(), few.end(), [](const Point& p) { return std::isnan(p.x); }), 1);
}

}  // namespace
}  // namespace hapticd::cli
