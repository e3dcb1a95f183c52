#include "client/cli/figure/figure.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <string>

#include "client/cli/figure/gnuplot.h"
#include "client/cli/plot/svg_file.h"
#include "client/cli/session/session.h"
#include "tests/support/temporary_folder.h"
#include "tests/support/value_of.h"

namespace hapticd::cli {
namespace {

/// A figure of one panel with this curve.
Figure of_points(const std::vector<Point>& points, FigurePanel panel = {.x = {"t"}}) {
  panel.series.push_back({.points = points});
  return {.panels = {panel}};
}

TEST(Figure, TheScriptHoldsItsDataUnitsAndNames) {
  Figure figure{.title = "a \"title\""};
  figure.panels.push_back({.x = {"displacement", "mm"}, .y = {"stiffness", "N/mm"}, .from_zero = true});
  figure.panels[0].series.push_back({.name = "hand", .points = {{0.0, 0.0}, {1.5, 0.6}, kBreak, {0.0, 1.0}}});
  const std::string script = gnuplot_script(figure, "out/it's.svg");
  EXPECT_NE(script.find("set output 'out/it''s.svg'"), std::string::npos);
  EXPECT_NE(script.find("'a \"title\"'"), std::string::npos);
  EXPECT_NE(script.find("$data_0_0 << EOD\n0 0\n1.5 0.6\n\n0 1\nEOD"), std::string::npos);
  EXPECT_NE(script.find("set xlabel 'displacement / mm' offset 0,0"), std::string::npos);
  EXPECT_NE(script.find("set ylabel 'stiffness / (N/mm)'"), std::string::npos);
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
  figure.panels.push_back({.x = {"t"}});
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
  figure.panels.push_back({.x = {"t"}, .bottom = 0.0, .height = 1.0});
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
  figure.panels.push_back({.x = {"t"}});
  figure.panels[0].series.push_back({.points = {{0.0, 3.0}, {1.0, 3.0}}});
  const std::string script = gnuplot_script(figure, "x.svg");
  EXPECT_NE(script.find("set label 2 'bbb"), std::string::npos) << script;
}

TEST(Figure, LabelsOfALowPanelDoNotOverlap) {
  Figure figure{.height_px = 700};
  figure.panels.push_back({.x = {"t"}, .height = 0.33});
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
  const Figure figure =
      of_points({{4.0, 3.0}, {5.0, 4.0}}, {.x = {.label = "t", .minimum = 0.0, .maximum = 9.0}});
  EXPECT_NE(gnuplot_script(figure, "x.svg").find("set xrange [0:9]"), std::string::npos);
}

TEST(Figure, ARangeFromZeroHidesNothingBelowZero) {
  const Figure figure = of_points({{1.0, -0.4}, {2.0, 4.0}}, {.x = {"t"}, .from_zero = true});
  EXPECT_NE(gnuplot_script(figure, "x.svg").find("set yrange [-1:4]"), std::string::npos)
      << gnuplot_script(figure, "x.svg");
}

TEST(Figure, ALogarithmicAxisIsLeftToGnuplotAndTheNextPanelIsLinear) {
  Figure figure =
      of_points({{0.01, 3.0}, {100.0, 4.0}}, {.x = {.label = "k", .logarithmic = true, .minimum = 0.001}});
  figure.panels.push_back(of_points({{1.0, 3.0}, {2.0, 4.0}}).panels[0]);
  const std::string script = gnuplot_script(figure, "x.svg");
  EXPECT_NE(script.find("set xrange [0.001:*]\nset logscale x"), std::string::npos) << script;
  EXPECT_NE(script.find("unset logscale", script.find("set logscale x")), std::string::npos) << script;
}

TEST(Figure, NamesStandInPlaceOfNumbers) {
  const Figure figure = of_points({{0.0, 3.0}, {1.0, 4.0}}, {.x = {.categories = {"sponge", "it's"}}});
  const std::string script = gnuplot_script(figure, "x.svg");
  EXPECT_NE(script.find("set xrange [-0.5:1.5]\nset xtics ('sponge' 0, 'it''s' 1)"), std::string::npos)
      << script;
}

TEST(Figure, AReferenceIsALabelledLineThatIsAlwaysInTheRange) {
  Figure figure = of_points({{0.0, 3.0}, {1.0, 4.0}});
  figure.panels[0].references = {{.value = 8.0, .label = "goal"}};
  const std::string script = gnuplot_script(figure, "x.svg");
  EXPECT_NE(script.find("set arrow 1 from graph 0, first 8 to graph 1, first 8 nohead"), std::string::npos);
  EXPECT_NE(script.find("'goal' at graph 0.99, first 8"), std::string::npos);
  EXPECT_NE(script.find("set yrange [3:8]"), std::string::npos) << script;
}

TEST(Figure, EightCurvesHaveEightColoursAndMarksOfTheirOwn) {
  Figure figure = of_points({{0.0, 3.0}, {1.0, 4.0}});
  figure.panels[0].series[0].marks_only();
  figure.panels[0].series.resize(8, figure.panels[0].series[0]);
  const std::string script = gnuplot_script(figure, "x.svg");
  for (std::size_t i = 0; i < 8; ++i)
    EXPECT_NE(script.find("lc rgb \"" + palette(i)), std::string::npos) << i;
  EXPECT_NE(script.find("with points pt 7 ps 0.7 lc rgb \"#0072b2"), std::string::npos) << script;
  EXPECT_NE(script.find("with points pt 5 ps 0.7 lc rgb \"#d55e00"), std::string::npos) << script;
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
