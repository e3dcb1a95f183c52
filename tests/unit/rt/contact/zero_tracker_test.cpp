#include "rt/contact/zero_tracker.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "rt/signal/vector.h"

namespace hapticd::rt {
namespace {

constexpr TickInterval kTick{1e-3, 1.0, 1.0, false};

/// A free tool under a sensor whose zero is at `zero_n` along x, for a tick.
double see(ZeroTracker& tracker, double zero_n) {
  tracker.drift_on(kTick);
  const double error_n = zero_n - tracker.force_n().x;
  tracker.update({{error_n, 0.0, 0.0}, {}}, 0.0, kTick);
  return error_n;
}

TEST(ZeroTracker, FollowsADriftAMillinewtonLate) {
  for (const double n_per_s : {1e-3, 5e-3, -5e-3}) {
    ZeroTracker tracker(0.4);
    double error_n = 0.0;
    double largest_n = 0.0;
    for (int i = 0; i < 60'000; ++i) {
      error_n = see(tracker, n_per_s * i * 1e-3);
      largest_n = std::max(largest_n, std::abs(error_n));
    }
    EXPECT_LT(std::abs(error_n), 1e-3);
    EXPECT_LT(largest_n, 0.4 * std::abs(n_per_s)) << "while it learns the rate";
  }
}

TEST(ZeroTracker, DriftsOnWhileItCannotBeSeen) {
  ZeroTracker tracker(0.4);
  const auto zero_n = [](int i) { return 5e-3 * i * 1e-3; };
  int i = 0;
  for (; i < 20'000; ++i) see(tracker, zero_n(i));
  for (; i < 30'000; ++i) tracker.drift_on(kTick);  // pressed for 10 s
  EXPECT_NEAR(tracker.force_n().x, zero_n(i), 0.006) << "of 50 mN, forgotten with the time of 60 s";
  // A drift that has ended meanwhile is not carried on for ever, nor far.
  const double seen_n = zero_n(20'000);
  for (; i < 600'000; ++i) tracker.drift_on(kTick);
  EXPECT_NEAR(tracker.force_n().x, seen_n + DriftTracker::kMaxUnseenN, 1e-4);
  EXPECT_LT(tracker.followed().force.rate_n_per_s().x, 1e-5);
}

TEST(ZeroTracker, FollowsADriftThatTurnsBack) {
  ZeroTracker tracker(0.4);
  int i = 0;
  for (; i < 20'000; ++i) see(tracker, 5e-6 * i);
  double largest_n = 0.0;
  for (; i < 40'000; ++i) largest_n = std::max(largest_n, std::abs(see(tracker, 5e-6 * (40'000 - i))));
  EXPECT_LT(largest_n, 0.005);
}

TEST(ZeroTracker, AMotionAndAStepTeachNoRate) {
  ZeroTracker tracker(0.4);
  for (int i = 0; i < 1000; ++i)
    tracker.update({{0.006, 0.0, 0.0}, {}}, -2.0 * ZeroTracker::kRestMmPerS, kTick);
  EXPECT_EQ(tracker.followed().force.rate_n_per_s().x, 0.0);
  for (int i = 0; i < 1000; ++i) see(tracker, 0.04);
  EXPECT_EQ(tracker.followed().force.rate_n_per_s().x, 0.0);
}

// A hand that lays the tool on an object as slowly as 20 mN/s is not a drift for long.
TEST(ZeroTracker, ASlowTouchIsSeenAndTeachesLittle) {
  ZeroTracker tracker(0.4);
  double load_n = 0.0;
  double error_n = 0.0;
  while (error_n < 0.015 && load_n < 0.1) error_n = see(tracker, load_n += 20e-6);
  EXPECT_LT(load_n, 0.03);
  const double zero_n = tracker.force_n().x;
  for (int i = 0; i < 60'000; ++i) tracker.drift_on(kTick);
  EXPECT_LE(tracker.force_n().x, zero_n + DriftTracker::kMaxUnseenN + 1e-12);
}

TEST(ZeroTracker, MotionAveragesOut) {
  ZeroTracker tracker(0.25);
  double largest = 0.0;
  for (int i = 0; i < 60'000; ++i) {  // a hand's wave: 0.1 N at 2.2 Hz
    const double read_n = 0.1 * std::sin(2.0 * std::numbers::pi * 2.2 * i * 1e-3);
    tracker.update({{read_n - tracker.force_n().x, 0.0, 0.0}, {}}, 0.0, kTick);
    largest = std::max(largest, std::abs(tracker.force_n().x));
  }
  EXPECT_LT(largest, 0.002);
}

TEST(ZeroTracker, ItsRateAndItsReachAreBounded) {
  ZeroTracker tracker(0.2);
  for (int i = 0; i < 5'000; ++i) tracker.update({{50.0, -50.0, 0.0}, {450.0, 0.0, 0.0}}, 0.0, kTick);
  EXPECT_NEAR(norm(tracker.force_n()), 5.0 * 2.0 * DriftTracker::kOmegaPerS * DriftTracker::kMaxErrorN, 1e-9);
  EXPECT_NEAR(tracker.torque_n_mm().x, 5.0 * ZeroTracker::kTorqueRateNMmPerS, 1e-9);
  EXPECT_FALSE(tracker.is_far());
  for (int i = 0; i < 15'000; ++i) tracker.update({{50.0, -50.0, 0.0}, {}}, 0.0, kTick);
  EXPECT_TRUE(tracker.is_far());
  EXPECT_FALSE(tracker.is_spent());
  for (int i = 0; i < 200'000; ++i) tracker.update({{50.0, -50.0, 0.0}, {}}, 0.0, kTick);
  EXPECT_TRUE(tracker.is_spent());
  const hal::Vector3 zero = tracker.force_n();
  EXPECT_LE(std::sqrt(dot(zero, zero)), 0.2 + 1e-12);
  EXPECT_EQ(tracker.faults(false), set_of(GuardFault::kSensorZeroLost));
  EXPECT_FALSE(tracker.take_bias(0)) << "still the same bias";
  EXPECT_TRUE(tracker.take_bias(1));
  EXPECT_EQ(tracker.faults(false), 0U);
}

TEST(ZeroTracker, GoesByTheMeasuredInterval) {
  ZeroTracker every(0.25);
  ZeroTracker late(0.25);
  for (int i = 0; i < 5000; ++i) every.update({{0.004, 0.0, 0.0}, {}}, 0.0, kTick);
  for (int i = 0; i < 1000; ++i) late.update({{0.004, 0.0, 0.0}, {}}, 0.0, {5e-3, 5.0, 5.0, false});
  EXPECT_NEAR(late.force_n().x, every.force_n().x, 1e-9);
}

}  // namespace
}  // namespace hapticd::rt
