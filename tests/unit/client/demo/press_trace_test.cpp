#include "client/cli/demo/press_trace.h"

#include <gtest/gtest.h>

#include <cmath>

namespace hapticd::cli {
namespace {

/// A press on a spring: 1 s up to `force_n` with an overshoot, `hold_s` held, 1 s down.
std::vector<PressPoint> press(double stiffness_n_per_mm, double force_n, double hold_s,
                              double overshoot = 0.0) {
  std::vector<PressPoint> points;
  for (double t = -0.5; t < 2.5 + hold_s; t += 1e-3) {
    double force = 0.0;
    if (t > 0.0) force = force_n * std::min({t, 1.0, 2.0 + hold_s - t});
    if (t > 1.0 && t < 1.1) force *= 1.0 + overshoot;
    force = std::max(force, 0.0);
    points.push_back({t, force / stiffness_n_per_mm, force + 0.02 * std::sin(200.0 * t), force > 0.0});
  }
  return points;
}

TEST(SettledHold, IsTheMeanOfTheSecondHalf) {
  const auto hold = settled_hold(press(0.38, 2.0, 2.0));
  ASSERT_TRUE(hold);
  EXPECT_NEAR(hold->stiffness_n_per_mm(), 0.38, 0.38 * 1e-3);
  EXPECT_NEAR(hold->hand_force_n, 2.0, 2e-3);
  EXPECT_NEAR(hold->duration_s, 0.85, 0.1);
}

TEST(SettledHold, AnOvershootIsNotAHold) {
  const auto hold = settled_hold(press(0.5, 2.0, 2.0, 0.5));
  ASSERT_TRUE(hold);
  EXPECT_NEAR(hold->hand_force_n, 2.0, 2e-3);
}

TEST(SettledHold, NeedsAHold) {
  EXPECT_FALSE(settled_hold({}));
  EXPECT_FALSE(settled_hold(std::vector<PressPoint>(1000)));
  EXPECT_FALSE(settled_hold(press(0.5, 2.0, 0.0)));
}

v1::TelemetrySample truth(double time_s, bool in_contact) {
  v1::TelemetrySample sample;
  sample.set_time_ns(std::llround(time_s * 1e9));
  sample.mutable_truth()->set_in_contact(in_contact);
  sample.mutable_truth()->mutable_hand_force_n()->set_z(-1.25);
  return sample;
}

TEST(PressTrace, IsOverSomeTimeAfterTheRelease) {
  PressTrace trace;
  trace.add({});  // no truth in it
  EXPECT_TRUE(trace.points().empty());
  trace.add(truth(0.0, false));
  EXPECT_FALSE(trace.touched());
  trace.add(truth(1.0, true));
  trace.add(truth(1.1, false));
  trace.add(truth(1.2, true));  // it only bounced
  trace.add(truth(2.0, false));
  trace.add(truth(2.2, false));
  EXPECT_TRUE(trace.touched());
  EXPECT_FALSE(trace.over());
  trace.add(truth(2.4, false));
  EXPECT_TRUE(trace.over());
  EXPECT_DOUBLE_EQ(trace.points().back().hand_force_n, 1.25);
}

}  // namespace
}  // namespace hapticd::cli
