#include "rt/contact/zero_tracker.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

namespace hapticd::rt {
namespace {

constexpr TickInterval kTick{1e-3, 1.0, 1.0, false};

TEST(ZeroTracker, FollowsADriftAFewMillinewtonsLate) {
  for (const double n_per_s : {1e-3, 2e-3, -2e-3}) {
    ZeroTracker tracker(0.25);
    double error_n = 0.0;
    for (int i = 0; i < 60'000; ++i) {
      error_n = n_per_s * i * 1e-3 - tracker.zero().force_n.x;
      tracker.update({{error_n, 0.0, 0.0}, {}}, kTick);
    }
    EXPECT_NEAR(error_n, n_per_s * ZeroTracker::kTimeS, 2e-4);
  }
}

TEST(ZeroTracker, MotionAveragesOut) {
  ZeroTracker tracker(0.25);
  double largest = 0.0;
  for (int i = 0; i < 60'000; ++i) {  // a hand's wave: 0.1 N at 2.2 Hz
    const double read_n = 0.1 * std::sin(2.0 * std::numbers::pi * 2.2 * i * 1e-3);
    tracker.update({{read_n - tracker.zero().force_n.x, 0.0, 0.0}, {}}, kTick);
    largest = std::max(largest, std::abs(tracker.zero().force_n.x));
  }
  EXPECT_LT(largest, 0.002);
}

TEST(ZeroTracker, ItsRateAndItsReachAreBounded) {
  ZeroTracker tracker(0.2);
  for (int i = 0; i < 10'000; ++i) tracker.update({{50.0, -50.0, 0.0}, {900.0, 0.0, 0.0}}, kTick);
  EXPECT_NEAR(tracker.zero().force_n.x, 10.0 * ZeroTracker::kForceRateNPerS, 1e-9);
  EXPECT_NEAR(tracker.zero().torque_n_mm.x, 10.0 * ZeroTracker::kTorqueRateNMmPerS, 1e-9);
  EXPECT_FALSE(tracker.is_far());
  for (int i = 0; i < 20'000; ++i) tracker.update({{50.0, -50.0, 0.0}, {}}, kTick);
  EXPECT_TRUE(tracker.is_far());
  EXPECT_FALSE(tracker.is_spent());
  for (int i = 0; i < 200'000; ++i) tracker.update({{50.0, -50.0, 0.0}, {}}, kTick);
  EXPECT_TRUE(tracker.is_spent());
  const hal::Vector3 zero = tracker.zero().force_n;
  EXPECT_LE(std::sqrt(dot(zero, zero)), 0.2 + 1e-12);
  EXPECT_EQ(tracker.faults(false), set_of(GuardFault::kSensorZeroLost));
  EXPECT_FALSE(tracker.take_bias(0)) << "still the same bias";
  EXPECT_TRUE(tracker.take_bias(1));
  EXPECT_EQ(tracker.faults(false), 0U);
}

TEST(ZeroTracker, GoesByTheMeasuredInterval) {
  ZeroTracker every(0.25);
  ZeroTracker late(0.25);
  for (int i = 0; i < 5000; ++i) every.update({{0.004, 0.0, 0.0}, {}}, kTick);
  for (int i = 0; i < 1000; ++i) late.update({{0.004, 0.0, 0.0}, {}}, {5e-3, 5.0, 5.0, false});
  EXPECT_NEAR(late.zero().force_n.x, every.zero().force_n.x, 1e-9);
}

}  // namespace
}  // namespace hapticd::rt
