// The hand's intended motion: boundary conditions and least jerk.

#include "hal/sim/hand/minimum_jerk.h"

#include <gtest/gtest.h>

#include <cmath>

namespace hapticd::sim {
namespace {

void expect_state(const MotionState& actual, const MotionState& expected, double tolerance) {
  EXPECT_NEAR(actual.position_mm, expected.position_mm, tolerance);
  EXPECT_NEAR(actual.velocity_mm_per_s, expected.velocity_mm_per_s, tolerance);
  EXPECT_NEAR(actual.acceleration_mm_per_s2, expected.acceleration_mm_per_s2, tolerance);
}

TEST(MinimumJerk, MeetsBothBoundaryStates) {
  const MotionState from{3.0, -40.0, 200.0};
  const MotionState to{-7.0, 90.0, -600.0};
  const MinimumJerk motion(from, to, 0.35);
  expect_state(motion.at(0.0), from, 1e-9);
  // Just before the end it is still the polynomial that speaks; a state moves by its rate times 1e-9 s.
  expect_state(motion.at(0.35 - 1e-9), to, 1e-4);
  expect_state(motion.at(0.35), to, 0.0);
}

TEST(MinimumJerk, StaysWhereItBeginsAndEnds) {
  const MinimumJerk motion({1.0, 0.0, 0.0}, {5.0, 0.0, 0.0}, 0.5);
  expect_state(motion.at(-1.0), {1.0, 0.0, 0.0}, 0.0);
  expect_state(motion.at(10.0), {5.0, 0.0, 0.0}, 0.0);
  EXPECT_FALSE(motion.over(0.499));
  EXPECT_TRUE(motion.over(0.5));
}

TEST(MinimumJerk, VelocityAndAccelerationAreDerivatives) {
  const MinimumJerk motion({3.0, -40.0, 200.0}, {-7.0, 90.0, -600.0}, 0.35);
  constexpr double kH = 1e-5;
  for (double t = 0.01; t < 0.34; t += 0.01) {
    const MotionState before = motion.at(t - kH), here = motion.at(t), after = motion.at(t + kH);
    EXPECT_NEAR(here.velocity_mm_per_s, (after.position_mm - before.position_mm) / (2.0 * kH), 1e-4);
    EXPECT_NEAR(here.acceleration_mm_per_s2,
                (after.velocity_mm_per_s - before.velocity_mm_per_s) / (2.0 * kH), 1e-2);
  }
}

/// ∫ jerk² over the motion plus ε times a bump that keeps all six boundary values: (s (1-s))³.
double jerk_cost(const MinimumJerk& motion, double epsilon_mm) {
  const double duration = motion.duration_s();
  constexpr int kSteps = 4000;
  const double h = duration / kSteps;
  double cost = 0.0;
  for (int i = 0; i < kSteps; ++i) {  // midpoint rule; the jerk is quadratic, its square smooth
    const double t = (i + 0.5) * h;
    const double s = t / duration;
    const double jerk =
        (motion.at(t + 0.25 * h).acceleration_mm_per_s2 - motion.at(t - 0.25 * h).acceleration_mm_per_s2) /
        (0.5 * h);
    const double bump =
        (6.0 - 72.0 * s + 180.0 * s * s - 120.0 * s * s * s) / (duration * duration * duration);
    cost += (jerk + epsilon_mm * bump) * (jerk + epsilon_mm * bump) * h;
  }
  return cost;
}

TEST(MinimumJerk, NoOtherMotionBetweenTheSameStatesHasLessJerk) {
  const MinimumJerk rest_to_rest({0.0, 0.0, 0.0}, {10.0, 0.0, 0.0}, 0.5);
  EXPECT_NEAR(jerk_cost(rest_to_rest, 0.0) / (720.0 * 100.0 / std::pow(0.5, 5.0)), 1.0, 1e-5);

  const MinimumJerk general({3.0, -40.0, 200.0}, {-7.0, 90.0, -600.0}, 0.35);
  const double least = jerk_cost(general, 0.0);
  for (const double epsilon_mm : {-20.0, -2.0, 2.0, 20.0}) EXPECT_GT(jerk_cost(general, epsilon_mm), least);
}

}  // namespace
}  // namespace hapticd::sim
