#include "client/cli/plot/figure.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <string>

#include "client/cli/session/session.h"
#include "tests/support/temporary_folder.h"
#include "tests/support/value_of.h"

namespace hapticd::cli {
namespace {

/// A figure of one panel with this curve.
Figure of_points(const std::vector<Point>& points, FigurePanel panel = {.x_label = "t"}) {
  panel.series.push_back({.points = points});
  return {.panels = {panel}};
}

TEST(Figure, TheScriptHoldsItsDataUnitsAndNames) {
  Figure figure{.title = "a \"title\""};
  figure.panels.push_back({.x_label = "displacement / mm", .y_label = "force / N", .from_zero = true});
  figure.panels[0].series.push_back({.name = "hand", .points = {{0.0, 0.0}, {1.5, 0.6}, kBreak, {0.0, 1.0}}});
  const std::string script = gnuplot_script(figure, "out/it's.svg");
  EXPECT_NE(script.find("set output 'out/it''s.svg'"), std::string::npos);
  EXPECT_NE(script.find("'a \"title\"'"), std::string::npos);
  EXPECT_NE(script.find("$data_0_0 << EOD\n0 0\n1.5 0.6\n\n0 1\nEOD"), std::string::npos);
  EXPECT_NE(script.find("set xlabel 'displacement / mm' offset 0,0"), std::string::npos);
  EXPECT_NE(script.find("title 'hand'"), std::string::npos);
}

TEST(Figure, APlotGoesToAFolderThatIsThere) {
  const test::TemporaryFolder folder;
  EXPECT_NO_THROW(require_svg_path("--out", "x.svg"));
  EXPECT_NO_THROW(require_svg_path("--out", folder.path("x.svg")));
  const std::string elsewhere = folder.path("a/b/x.svg");
  const LocalError error = test::thrown_by<LocalError>([&] { require_svg_path("--out", elsewhere); });
  EXPECT_EQ(error.detail().value(), elsewhere);
  EXPECT_EQ(error.detail().where(), "--out");
  EXPECT_FALSE(error.detail().remedy().empty());
  EXPECT_FALSE(std::filesystem::exists(folder.path("a")));
  EXPECT_THROW(require_svg_path("--out", folder.path("x.png")), LocalError);
}

TEST(Figure, ATitleOfTheDaemonIsNoCommand) {
  // In double quotes gnuplot would run what is between backquotes.
  Figure figure{.title = "`touch x`\n'; system \"touch y\"; '\x1b"};
  figure.panels.push_back({.x_label = "t"});
  const std::string script = gnuplot_script(figure, "x.svg");
  EXPECT_NE(script.find("title '`touch x`\\n''; system \"touch y\"; ''\\u001b' font"), std::string::npos)
      << script;
}

TEST(Figure, AQuantityThatNeverChangesHasARange) {
  Figure figure = of_points({{0.0, 3.0}, {1.0, 3.0}});
  EXPECT_NE(gnuplot_script(figure, "x.svg").find("set yrange [2.5:3.5]"), std::string::npos);
}

TEST(Figure, NotesHaveTheirOwnLinesBelowAllPanels) {
  Figure figure{.height_px = 600, .notes = {"first", "second"}};
  figure.panels.push_back({.x_label = "t", .bottom = 0.0, .height = 1.0});
  figure.panels[0].series.push_back({.points = {{0.0, 3.0}, {1.0, 3.0}}});
  figure.panels.push_back(figure.panels[0]);
  const std::string script = gnuplot_script(figure, "x.svg");
  EXPECT_NE(script.find("set label 1 'first' at screen 0.012,0.0480"), std::string::npos) << script;
  EXPECT_NE(script.find("set label 2 'second' at screen 0.012,0.0180"), std::string::npos) << script;
  EXPECT_NE(script.find("set origin 0,0.06\nset size 1,0.94"), std::string::npos) << "panels are above";
  EXPECT_EQ(script.find("set label", script.find("unset label") + 5), std::string::npos) << "drawn once";
}

TEST(Figure, ANoteIsBrokenIntoLinesThatFit) {
  Figure figure{
      .width_px = 600, .height_px = 600, .notes = {std::string(39, 'a') + " " + std::string(60, 'b')}};
  figure.panels.push_back({.x_label = "t"});
  figure.panels[0].series.push_back({.points = {{0.0, 3.0}, {1.0, 3.0}}});
  const std::string script = gnuplot_script(figure, "x.svg");
  EXPECT_NE(script.find("set label 2 'bbb"), std::string::npos) << script;
}

TEST(Figure, LabelsOfALowPanelDoNotOverlap) {
  Figure figure{.height_px = 700};
  figure.panels.push_back({.x_label = "t", .height = 0.33});
  figure.panels[0].series.push_back({.points = {{0.0, 0.3}, {1.0, 0.7}}});
  const std::string script = gnuplot_script(figure, "x.svg");
  const auto from = script.find("set ytics (");
  ASSERT_NE(from, std::string::npos);
  const std::string labels = script.substr(from, script.find(')', from) - from);
  EXPECT_LE(std::count(labels.begin(), labels.end(), ','), 4) << labels;
  EXPECT_GE(std::count(labels.begin(), labels.end(), ','), 1) << labels;
}

TEST(Figure, WithoutNamesThereIsNoLegend) {
  Figure figure = of_points({{0.0, 0.3}, {1.0, 0.7}});
  EXPECT_NE(gnuplot_script(figure, "x.svg").find("unset key"), std::string::npos);
  figure.panels[0].series[0].name = "force";
  EXPECT_EQ(gnuplot_script(figure, "x.svg").find("unset key"), std::string::npos);
}

TEST(Figure, AGivenRangeIsUsed) {
  const Figure figure = of_points({{4.0, 3.0}, {5.0, 4.0}}, {.x_label = "t", .x_range = Range{0.0, 9.0}});
  EXPECT_NE(gnuplot_script(figure, "x.svg").find("set xrange [0:9]"), std::string::npos);
}

TEST(Figure, ARangeFromZeroHidesNothingBelowZero) {
  const Figure figure = of_points({{1.0, -0.4}, {2.0, 4.0}}, {.x_label = "t", .from_zero = true});
  EXPECT_NE(gnuplot_script(figure, "x.svg").find("set yrange [-1:4]"), std::string::npos)
      << gnuplot_script(figure, "x.svg");
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
