#include "client/cli/plot/recording_figure.h"

#include <gtest/gtest.h>

#include <cmath>
#include <string>

#include "client/cli/session/session.h"
#include "tests/support/temporary_folder.h"

namespace hapticd::cli {
namespace {

constexpr const char* kColumns =
    "time_s,contact_in_contact,truth_in_contact,deformation_displacement_mm,truth_displacement_mm,"
    "truth_hand_force_z_n,contact_reaction_force_n,target_stiffness_n_per_mm\n";

/// Rows of a recording in which the estimate begins at 0 and the truth at `begins_mm`, then nothing is
/// touched. The target is there from the third row on.
std::string press(double from_s, double begins_mm) {
  std::string rows;
  for (int i = 0; i < 6; ++i) {
    const double t = from_s + 0.1 * i;
    const bool touches = i >= 1 && i < 5;
    const double depth = touches ? 1.0 * (i - 1) : 0.0;
    rows += std::to_string(t) + (touches ? ",1,1," : ",0,0,") + std::to_string(depth) + "," +
            std::to_string(touches ? depth + begins_mm : 0.0) + "," + std::to_string(-0.4 * depth) + "," +
            std::to_string(0.3 * depth) + (i < 2 ? ",\n" : ",0.5\n");
  }
  return rows;
}

Figure figure_of(const std::string& rows) {
  const test::TemporaryFolder folder;
  return recording_figure(CsvTable::read(folder.write("r.csv", kColumns + rows)));
}

const FigureSeries& series(const FigurePanel& panel, const std::string& name) {
  for (const FigureSeries& one : panel.series) {
    if (one.name == name) return one;
  }
  ADD_FAILURE() << "no " << name;
  return panel.series.front();
}

TEST(RecordingFigure, SaysWhyTheTruthIsShifted) {
  EXPECT_TRUE(figure_of(press(0.0, 0.0)).notes.empty()) << "nothing is shifted";
  const Figure crept = figure_of(press(0.0, 0.0) + press(2.0, 0.8));
  ASSERT_EQ(crept.notes.size(), 1U);
  EXPECT_NE(crept.notes[0].find("0.8 mm to the right"), std::string::npos) << crept.notes[0];
  EXPECT_NE(crept.notes[0].find("not recovered from the press before"), std::string::npos) << crept.notes[0];
}

TEST(RecordingFigure, SaysWhatASecondContactAtReleaseIs) {
  // Free for less than a third of a second; that one says nothing of creep, however deep the truth is.
  const Figure bounced = figure_of(press(0.0, 0.0) + press(0.6, 5.0));
  ASSERT_EQ(bounced.notes.size(), 1U);
  EXPECT_NE(bounced.notes[0].find("the tip comes free"), std::string::npos) << bounced.notes[0];
}

TEST(RecordingFigure, ABounceWhereAPressBeginsHidesNoShift) {
  const std::string bounce = "1.9,1,1,0,0.1,0,0,0.5\n1.95,0,0,0,0,0,0,0.5\n";
  const Figure crept = figure_of(press(0.0, 0.0) + bounce + press(2.0, 0.8));
  ASSERT_EQ(crept.notes.size(), 1U);
  EXPECT_NE(crept.notes[0].find("0.8 mm to the right"), std::string::npos) << crept.notes[0];
}

TEST(RecordingFigure, OfNoContactIsWideHasAKeyAndSaysSo) {
  const Figure figure = figure_of("0.0,0,0,0,0,0,0.1,0.5\n0.1,0,0,0,0,0,0.2,0.5\n");
  const FigurePanel& forces = figure.panels.at(0);
  EXPECT_EQ(series(forces, "reaction").points.size(), 2U);
  EXPECT_EQ(forces.title.find("left"), std::string::npos) << "there is no panel to the left of it";
  for (const FigurePanel& panel : figure.panels) EXPECT_EQ(panel.width, 1.0) << panel.y.label;
  ASSERT_EQ(figure.notes.size(), 1U);
  EXPECT_NE(figure.notes[0].find("No contact was declared"), std::string::npos);
}

TEST(RecordingFigure, DrawsForceOverDisplacementOnlyWhileTouching) {
  const Figure figure = figure_of(press(0.0, 0.0) + press(2.0, 0.0));
  const FigurePanel& curve = figure.panels.at(0);
  for (const char* name : {"hand, true", "reaction"}) {
    SCOPED_TRACE(name);
    const auto& points = series(curve, name).points;
    ASSERT_EQ(points.size(), 10U) << "four of each press, a break after each";
    EXPECT_TRUE(std::isnan(points[4].x)) << "no line from where it was let go to where it is touched again";
    EXPECT_EQ(points[3].x, 3.0);
  }
  EXPECT_EQ(series(curve, "hand, true").line, FigureSeries::Line::kSolid) << "drawn like the others";
  EXPECT_FALSE(curve.title.empty());
}

TEST(RecordingFigure, AllPanelsShareOneTimeAxis) {
  const Figure figure = figure_of(press(1.0, 0.0));
  ASSERT_EQ(figure.panels.size(), 4U);
  for (std::size_t i = 1; i < 4; ++i) {
    EXPECT_EQ(figure.panels[i].x.minimum, 0.0);
    EXPECT_NEAR(figure.panels[i].x.maximum.value(), 0.5, 1e-9) << "also of the target, which is there later";
  }
}

TEST(RecordingFigure, ALegendLiesOnNoCurve) {
  const Figure figure = figure_of(press(0.0, 0.0));
  for (const FigurePanel& panel : figure.panels) {
    bool named = false;
    for (const FigureSeries& one : panel.series) named = named || !one.name.empty();
    if (named) {
      EXPECT_NE(panel.legend, FigurePanel::Legend::kUpperLeft);
    }
  }
}

TEST(RecordingFigure, NaNAndAbsurdValuesAreLeftOut) {
  const Figure figure = figure_of("0,1,1,0,0,-1,1,0.5\n1,1,1,1,1,nan,1e308,0.5\n2,1,1,2,2,-2,-1e308,0.5\n");
  for (const FigurePanel& panel : figure.panels) {
    for (const FigureSeries& one : panel.series) {
      for (const Point& point : one.points) EXPECT_FALSE(std::abs(point.y) > 3.0) << one.name;
    }
  }
}

TEST(RecordingFigure, WithoutAnythingToDrawIsRefused) {
  const test::TemporaryFolder folder;
  const CsvTable table = CsvTable::read(folder.write("r.csv", "time_s,tick\n0,1\n1,2\n"));
  EXPECT_THROW(recording_figure(table), LocalError);
}

}  // namespace
}  // namespace hapticd::cli
