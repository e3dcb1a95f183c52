#include "rt/guard/guard.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>

#include "rt/signal/vector.h"

namespace hapticd::rt {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

GuardLimits limits() {
  GuardLimits l;
  l.max_force_n = 8.5;
  l.max_force_rate_n_per_s = 1700.0;
  l.max_power_w = 2.0;
  l.sensor_stale_after_ms = 2.0;
  l.resume_ramp_s = 0.1;
  return l;
}

/// One tick through the gate.
hal::Vector3 pass(Guard& guard, const hal::Vector3& wanted, const hal::RigSample& sample,
                  TickRecord& record) {
  record = TickRecord{};
  const hal::Vector3 force_n = guard.release(guard.admit(sample), wanted, 0);
  guard.fill_record(record);
  return force_n;
}

TEST(Guard, BoundsMagnitudeKeepingTheDirection) {
  Guard guard(limits(), 1000.0);
  TickRecord record;
  hal::Vector3 force;
  for (int i = 0; i < 20; ++i) force = pass(guard, {30.0, 0.0, -40.0}, {}, record);
  EXPECT_NEAR(norm(force), 8.5, 1e-9);
  EXPECT_NEAR(force.x / force.z, -0.75, 1e-9);
  EXPECT_TRUE(record.guard_limits & guard_limit::kForce);
}

TEST(Guard, BoundsTheChangePerTick) {
  Guard guard(limits(), 1000.0);
  TickRecord record;
  EXPECT_NEAR(pass(guard, {0.0, 0.0, 8.0}, {}, record).z, 1.7, 1e-12);
  EXPECT_TRUE(record.guard_limits & guard_limit::kRate);
  EXPECT_NEAR(pass(guard, {0.0, 0.0, 8.0}, {}, record).z, 3.4, 1e-12);
  EXPECT_NEAR(pass(guard, {0.0, 0.0, 3.0}, {}, record).z, 3.0, 1e-12);
  EXPECT_EQ(record.guard_limits, 0);
}

TEST(Guard, BoundsPowerIntoTheHandOnly) {
  // 400 mm/s along +z; 8 N that way are 3.2 W, the other way they brake.
  for (const double sign : {1.0, -1.0}) {
    Guard guard(limits(), 1000.0);
    TickRecord record;
    hal::Vector3 force;
    hal::RigSample sample;
    for (int i = 0; i < 200; ++i) {
      sample.tip_position_mm.z = 0.4 * i;
      force = pass(guard, {0.0, 0.0, sign * 8.0}, sample, record);
    }
    EXPECT_NEAR(std::abs(force.z), sign > 0 ? 5.0 : 8.0, 1e-6);
    EXPECT_EQ((record.guard_limits & guard_limit::kPower) != 0, sign > 0);
  }
}

/// A guard on a separate clock: 1 kHz unless a tick is said to take longer.
struct TimedGuard {
  explicit TimedGuard(const GuardLimits& l, double rate = 1000.0) : guard(l, rate), rate_hz(rate) {}
  hal::Vector3 tick(const hal::Vector3& wanted, double interval_s = 0.0) {
    sample.time_ns += static_cast<std::int64_t>(1e9 * (interval_s > 0.0 ? interval_s : 1.0 / rate_hz));
    return pass(guard, wanted, sample, record);
  }
  Guard guard;
  double rate_hz;
  hal::RigSample sample;
  TickRecord record;
};

TEST(Guard, LimitsHoldFromTheTickInWhichTheyChange) {
  TimedGuard bench(limits());
  for (int i = 0; i < 20; ++i) bench.tick({0.0, 0.0, 8.0});
  GuardLimits lower = limits();
  lower.max_force_n = 1.0;
  lower.max_force_rate_n_per_s = 200.0;  // 0.2 N a tick: 35 of them down to 1 N
  bench.guard.set_limits(lower);
  EXPECT_NEAR(bench.tick({0.0, 0.0, 8.0}).z, 1.0, 1e-12);
  EXPECT_TRUE(bench.record.guard_limits & guard_limit::kForce);
  EXPECT_NEAR(bench.tick({0.0, 0.0, -8.0}).z, 0.8, 1e-12) << "and from there on the rate counts";
}

TEST(Guard, RendersWeakerWhereTheArmGivesLessInItsPose) {
  TimedGuard bench(limits());
  for (int i = 0; i < 20; ++i) bench.tick({0.0, 0.0, 8.0});
  bench.sample.max_force_n = 6.0;
  EXPECT_NEAR(bench.tick({0.0, 0.0, 8.0}).z, 6.0, 1e-12) << "in this very tick";
  EXPECT_EQ(bench.record.guard_state, GuardState::kRendering);
  EXPECT_EQ(bench.record.faults_present, 0U);
  EXPECT_TRUE(bench.record.guard_limits & guard_limit::kForce);
  EXPECT_TRUE(bench.record.guard_limits & guard_limit::kPose) << "and it is reported why";
  EXPECT_NEAR(bench.tick({0.0, 0.0, 5.0}).z, 5.0, 1e-12);
  EXPECT_EQ(bench.record.guard_limits, 0);
  bench.sample.max_force_n = 20.0;  // the pose gives more than the scene allows
  for (int i = 0; i < 20; ++i) bench.tick({0.0, 0.0, 30.0});
  EXPECT_NEAR(bench.tick({0.0, 0.0, 30.0}).z, 8.5, 1e-12);
  EXPECT_FALSE(bench.record.guard_limits & guard_limit::kPose);
}

TEST(Guard, PowerIsBoundedFromTheFirstTickOfAFastMotion) {
  // Pressing 8 N at rest, then torn along with 1 m/s.
  for (const double rate_hz : {1000.0, 5000.0, 10000.0}) {
    TimedGuard bench(limits(), rate_hz);
    for (int i = 0; i < static_cast<int>(0.05 * rate_hz); ++i) bench.tick({0.0, 0.0, 8.0});
    double excess_mj = 0.0;
    for (int i = 1; i <= static_cast<int>(0.05 * rate_hz); ++i) {
      bench.sample.tip_position_mm.z += 1000.0 / rate_hz;
      const double power_w = bench.tick({0.0, 0.0, 8.0}).z;  // at 1 m/s: as many watts as newtons
      excess_mj += 1e3 * std::max(0.0, power_w - 2.0) / rate_hz;
      // What is seen of 1 m/s: all of the path of up to 4 ms but 0.1 mm, and a tick less.
      const double seen_s = std::min(4e-3, (i - 1) / rate_hz);
      if (i > 0.001 * rate_hz) {
        EXPECT_LE(power_w, 2.0 / (1.0 - 0.1e-3 / seen_s) + 1e-9)
            << "tick " << i << " at " << rate_hz << " Hz";
      }
    }
    // Four times what three counts hide, and the tick before the motion shows.
    EXPECT_LE(excess_mj, 4.0 * 8.0 * 0.1 + 8.0 * 1000.0 / rate_hz) << rate_hz << " Hz";
  }
}

TEST(Guard, OneEncoderCountIsNoPower) {
  for (const double rate_hz : {1000.0, 10000.0}) {
    GuardLimits l = limits();
    l.max_power_w = 0.04;
    TimedGuard bench(l, rate_hz);
    for (int i = 0; i < 100; ++i) bench.tick({0.0, 0.0, 8.5});
    for (int i = 0; i < 100; ++i) {
      bench.sample.tip_position_mm.z = i < 50 ? 0.0 : 0.03;
      EXPECT_NEAR(bench.tick({0.0, 0.0, 8.5}).z, 8.5, 1e-9) << rate_hz << " Hz, tick " << i;
    }
  }
}

TEST(Guard, MeasuresSpeedByTrueTimes) {
  // 200 mm/s with every other tick late by 0.9 ms: 8 N are 1.6 W, within the bound.
  TimedGuard bench(limits());
  for (int i = 0; i < 400; ++i) {
    const double interval_s = i % 2 == 0 ? 1.9e-3 : 1e-4;
    bench.sample.tip_position_mm.z += 200.0 * interval_s;
    bench.tick({0.0, 0.0, 8.0}, interval_s);
    EXPECT_FALSE(bench.record.guard_limits & guard_limit::kPower) << "tick " << i;
  }
  EXPECT_NEAR(bench.tick({0.0, 0.0, 8.0}).z, 8.0, 1e-9);
}

TEST(Guard, AfterAllBoundsEachHolds) {
  std::mt19937_64 random(5);
  std::normal_distribution<double> wild(0.0, 12.0);
  std::uniform_real_distribution<double> any(0.0, 1.0);
  TimedGuard bench(limits());
  GuardLimits l = limits();
  hal::Vector3 before;
  PushSpeed speed;
  hal::Vector3 velocity;
  for (int i = 0; i < 100000; ++i) {
    if (any(random) < 0.01) {
      l.max_force_n = 1.0 + 7.5 * any(random);
      l.max_power_w = 0.2 + 2.0 * any(random);
      l.max_force_rate_n_per_s = 100.0 + 2000.0 * any(random);
      bench.guard.set_limits(l);
    }
    if (any(random) < 0.01) bench.sample.max_force_n = 8.0 * any(random);
    velocity = velocity * 0.9 + hal::Vector3{wild(random), wild(random), wild(random)} * 5.0;
    const double interval_s = any(random) < 0.1 ? 0.02 * any(random) + 1e-6 : 1e-3;
    bench.sample.tip_position_mm = bench.sample.tip_position_mm * 0.99 + velocity * interval_s;
    const std::int64_t time_before_ns = bench.sample.time_ns;
    const hal::Vector3 force = bench.tick({wild(random), wild(random), wild(random)}, interval_s);
    const double measured_s = 1e-9 * static_cast<double>(bench.sample.time_ns - time_before_ns);
    speed.update(bench.sample.tip_position_mm, measured_s);
    const double magnitude_n = norm(force);
    const double max_n =
        bench.sample.max_force_n > 0.0 ? std::min(l.max_force_n, bench.sample.max_force_n) : l.max_force_n;
    ASSERT_LE(magnitude_n, max_n + 1e-9);
    if (magnitude_n > 0.0) {
      const double power_w = 1e-3 * magnitude_n * speed.along_mm_per_s(force * (1.0 / magnitude_n));
      ASSERT_LE(power_w, l.max_power_w + 1e-9);
      // The rate: exceeded towards less force only.
      if (norm(force - before) > l.max_force_rate_n_per_s * std::min(measured_s, 1e-3) + 1e-6) {
        ASSERT_LT(magnitude_n, norm(before) + l.max_force_rate_n_per_s * 1e-3);
        ASSERT_TRUE(bench.record.guard_limits & (guard_limit::kForce | guard_limit::kPower));
      }
    }
    before = force;
  }
}

TEST(Guard, RampsTakeTheirTimeHoweverIrregularTheTicks) {
  TimedGuard bench(limits());  // resumes over 0.1 s
  bench.guard.raise(GuardFault::kStopped);
  bench.tick({0.0, 0.0, 5.0});
  ASSERT_TRUE(bench.guard.clear());
  double elapsed_s = 0.0;
  for (int i = 0; i < 30; ++i) {
    const double interval_s = i % 3 == 0 ? 4e-3 : 5e-4;
    elapsed_s += interval_s;
    bench.tick({0.0, 0.0, 5.0}, interval_s);
    EXPECT_NEAR(bench.record.authority, elapsed_s / 0.1, 1e-9);
  }
  const double before = bench.record.authority;
  bench.tick({0.0, 0.0, 5.0}, 0.04);
  EXPECT_NEAR(bench.record.authority, before + Guard::kMaxRampStepS / 0.1, 1e-9) << "a gap is no ramp";
}

TEST(Guard, AStepOfForceIsBoundedAsForOnePeriodHoweverLateTheTick) {
  TimedGuard bench(limits());
  bench.tick({});
  EXPECT_NEAR(bench.tick({0.0, 0.0, 8.0}, 0.03).z, 1.7, 1e-9);
  EXPECT_NEAR(bench.tick({0.0, 0.0, 8.0}, 5e-4).z, 1.7 + 0.85, 1e-9) << "a tick that is early gets less";
}

TEST(Guard, WritesZeroInsteadOfATrace) {
  TimedGuard bench(limits());
  for (const double trace : {9e-13, 1e-310, 5e-324}) {
    const hal::Vector3 force = bench.tick({trace, -trace, 0.5});
    EXPECT_EQ(force.x, 0.0);
    EXPECT_EQ(force.y, 0.0);
    EXPECT_EQ(force.z, 0.5);
  }
  EXPECT_EQ(bench.tick({0.0, 0.0, -2e-6}).z, -2e-6);
}

TEST(Guard, NoNumberAnywhereInASampleGivesZeroInTheSameTickAndStaysLatched) {
  for (void (*spoil)(hal::RigSample&) : {+[](hal::RigSample& s) { s.tip_position_mm.y = kNan; },
                                         +[](hal::RigSample& s) { s.tip_position_mm.x = HUGE_VAL; },
                                         +[](hal::RigSample& s) { s.tip_orientation.z = kNan; },
                                         +[](hal::RigSample& s) { s.sensor_force_n.z = kNan; },
                                         +[](hal::RigSample& s) { s.sensor_torque_n_mm.x = kNan; }}) {
    Guard guard(limits(), 1000.0);
    TickRecord record;
    for (int i = 0; i < 10; ++i) pass(guard, {0.0, 0.0, 5.0}, {}, record);
    hal::RigSample bad;
    spoil(bad);
    EXPECT_EQ(norm(pass(guard, {0.0, 0.0, 5.0}, bad, record)), 0.0);
    EXPECT_FALSE(guard.clear());
    for (int i = 0; i < 10; ++i) EXPECT_EQ(norm(pass(guard, {0.0, 0.0, 5.0}, {}, record)), 0.0);
    EXPECT_EQ(record.guard_state, GuardState::kLatched);
    EXPECT_EQ(record.guard_fault, GuardFault::kNonFinite) << "the first cause is kept";
    EXPECT_TRUE(guard.clear());
    EXPECT_EQ(guard.state(), GuardState::kResuming);
  }
}

TEST(Guard, ASilentSensorDoesNotSayThatItsFaultIsOver) {
  using namespace hal::sample_status;
  for (const std::uint32_t said : {kForceSaturated, kForceFault, kForceLost}) {
    Guard guard(limits(), 1000.0);
    TickRecord record;
    hal::RigSample sample;
    sample.status = said;
    pass(guard, {}, sample, record);
    sample.status = kForceMissing;  // a late sample, still fresh enough
    for (int i = 0; i < 2; ++i) {
      pass(guard, {}, sample, record);
      EXPECT_FALSE(guard.clear()) << said;
      EXPECT_NE(record.faults_present, 0U) << said;
    }
    pass(guard, {}, {}, record);
    EXPECT_TRUE(guard.clear()) << said;
  }
  // Silence alone is not a fault: nothing was reported that could last.
  Guard guard(limits(), 1000.0);
  TickRecord record;
  hal::RigSample sample;
  sample.status = kForceMissing;
  pass(guard, {}, sample, record);
  EXPECT_EQ(record.faults_present, 0U);
}

TEST(Guard, NonFiniteCommandLatches) {
  for (const double bad : {kNan, HUGE_VAL, -HUGE_VAL}) {
    Guard guard(limits(), 1000.0);
    TickRecord record;
    EXPECT_EQ(norm(pass(guard, {0.0, bad, 1.0}, {}, record)), 0.0);
    EXPECT_EQ(record.guard_fault, GuardFault::kNonFinite);
  }
}

TEST(Guard, WhateverComesTheForceIsFiniteAndWithinLimits) {
  std::mt19937_64 random(11);
  std::uniform_int_distribution<int> kind(0, 15);
  std::normal_distribution<double> wild(0.0, 100.0);
  const auto value = [&]() -> double {
    switch (kind(random)) {
      case 0:
        return kNan;
      case 1:
        return HUGE_VAL;
      case 2:
        return -1e300;
      case 3:
        return 5e-324;
      default:
        return wild(random);
    }
  };
  Guard guard(limits(), 1000.0);
  TickRecord record;
  hal::Vector3 before;
  for (int i = 0; i < 200000; ++i) {
    hal::RigSample sample;
    if (kind(random) < 2) sample.tip_position_mm = {value(), value(), value()};
    if (kind(random) == 0) sample.sensor_force_n.z = value();
    if (kind(random) == 0) sample.status = static_cast<std::uint32_t>(kind(random));
    if (kind(random) == 0) sample.force_age_ns = static_cast<std::int64_t>(kind(random)) * 1'000'000;
    const hal::Vector3 force = pass(guard, {value(), value(), value()}, sample, record);
    ASSERT_TRUE(std::isfinite(force.x) && std::isfinite(force.y) && std::isfinite(force.z));
    ASSERT_LE(norm(force), 8.5 + 1e-9);
    // Less by more than that only if magnitude or power ask for it.
    if (record.guard_state != GuardState::kLatched && (record.guard_limits & guard_limit::kPower) == 0) {
      ASSERT_LE(norm(force - before), 1.7 + 1e-9);
    }
    before = force;
    if (kind(random) < 4) guard.clear();
  }
}

}  // namespace
}  // namespace hapticd::rt
