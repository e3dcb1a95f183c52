#include "client/cli/demo/demo_view.h"

#include <gtest/gtest.h>

#include <cmath>
#include <nlohmann/json.hpp>
#include <string>

namespace hapticd::cli {
namespace {

/// A press to 8 mm and 4 N; the hand lifts faster than the object recovers: at 5 mm and 2 N the tip comes
/// free, and touches once more between 4.8 and 4.9 mm.
DemoPress press(std::optional<double> target_n_per_mm) {
  DemoPress done{.target_n_per_mm = target_n_per_mm};
  double time_s = 0.0;
  const auto sample = [&](double displacement_mm, double force_n, bool in_contact) {
    v1::TelemetrySample point;
    point.set_time_ns(std::llround((time_s += 1e-3) * 1e9));
    point.mutable_truth()->set_in_contact(in_contact);
    point.mutable_truth()->set_displacement_mm(displacement_mm);
    point.mutable_truth()->mutable_hand_force_n()->set_z(-force_n);
    done.trace.add(point);
  };
  for (int i = 0; i < 100; ++i) sample(0.0, 0.05, false);
  for (int i = 0; i <= 800; ++i) sample(0.01 * i, 0.005 * i, true);
  for (int i = 0; i < 1000; ++i) sample(8.0, 4.0, true);
  for (int i = 0; i <= 300; ++i) sample(8.0 - 0.01 * i, 4.0 - 0.02 / 3.0 * i, true);
  for (int i = 0; i < 10; ++i) sample(4.9, 1.0, false);
  for (int i = 0; i < 10; ++i) sample(4.9 - 0.01 * i, 0.5, true);
  for (int i = 0; i < 400; ++i) sample(3.0, -0.2, false);
  done.hold = settled_hold(done.trace.points());
  return done;
}

TEST(ReleasePoint, IsWhereTheLiftedTipFirstComesFree) {
  const auto release = release_point(press({}).trace.points());
  ASSERT_TRUE(release);
  EXPECT_NEAR(release->displacement_mm, 5.0, 1e-9);
  EXPECT_NEAR(release->hand_force_n, 2.0, 1e-9);
  EXPECT_FALSE(release_point({}));
  EXPECT_FALSE(release_point({{0.0, 1.0, 1.0, false}})) << "never touched";
  EXPECT_FALSE(release_point({{0.0, 1.0, 1.0, true}, {1.0, 0.5, 0.5, true}})) << "not let go of";
}

TEST(DemoFigure, ShowsAndExplainsWhereTheTipComesFree) {
  const Figure figure = demo_figure({press({}), press(0.5)}, "demo");
  const FigurePanel& felt = figure.panels.at(0);
  const FigureSeries* marks = nullptr;
  for (const FigureSeries& one : felt.series) {
    if (one.name == "the tip comes free") marks = &one;
    if (one.line != FigureSeries::Line::kSolid) continue;
    // A curve ends there: nothing of what follows is drawn as rendered.
    ASSERT_FALSE(one.points.empty());
    EXPECT_NEAR(one.points.back().x, 5.0, 1e-9) << one.name;
    EXPECT_NEAR(one.points.back().y, 2.0, 1e-9) << one.name;
  }
  ASSERT_NE(marks, nullptr);
  EXPECT_EQ(marks->points.size(), 2U) << "one for each press";
  EXPECT_EQ(felt.legend, FigurePanel::Legend::kBelow);
  ASSERT_EQ(figure.notes.size(), 1U);
  EXPECT_NE(figure.notes[0].find("recovers more slowly than the hand lifts"), std::string::npos);
}

TEST(DemoFigure, DrawsNoLineThroughTheAir) {
  const Figure figure = demo_figure({press({}), press(0.5)}, "demo");
  for (const FigureSeries& one : figure.panels.at(0).series) {
    if (one.line == FigureSeries::Line::kDashed || one.points.empty()) continue;
    for (std::size_t i = 1; i < one.points.size(); ++i) {
      const double step = std::abs(one.points[i].x - one.points[i - 1].x);
      EXPECT_FALSE(step > 0.5 && one.mark != FigureSeries::Mark::kOpenSquare)
          << one.name << " at " << one.points[i].x;
    }
  }
}

TEST(DemoTable, FitsEightyColumns) {
  const Terminal terminal{.unicode = true, .width = 80, .height = 24};
  const std::vector<DemoPress> presses{press({}), press(0.3), press(0.5)};
  for (const std::string& line : result_table(presses).lines(terminal, 2)) {
    EXPECT_LE(display_width(line), 80U) << line;
  }
  bool displacement = false;
  for (const std::string& line : demo_frame(presses, "done", terminal)) {
    EXPECT_LE(display_width(line), 80U) << line;
    displacement = displacement || line.find("8.000 mm") != std::string::npos;
  }
  EXPECT_TRUE(displacement) << "the last column";
}

TEST(DemoResults, SayWhereTheTipCameFree) {
  const Json results = result_json({press(0.5)});
  EXPECT_NEAR(results[0]["came_free_at_mm"].get<double>(), 5.0, 1e-9);
  EXPECT_NEAR(results[0]["hand_force_then_n"].get<double>(), 2.0, 1e-9);
}

}  // namespace
}  // namespace hapticd::cli
