#include "rt/guard/guard.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>

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

double norm(const hal::Vector3& v) {
  return std::sqrt(dot(v, v));
}

/// One tick through the gate.
hal::Vector3 pass(Guard& guard, const hal::Vector3& wanted, const hal::RigSample& sample,
                  TickRecord& record) {
  record = TickRecord{};
  guard.admit(sample);
  return guard.bound(wanted, sample, record);
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

struct FaultCase {
  const char* name;
  hal::RigSample sample;
  GuardFault fault;
};

std::vector<FaultCase> faults() {
  std::vector<FaultCase> all;
  const auto add = [&all](const char* name, GuardFault fault, auto change) {
    hal::RigSample sample;
    change(sample);
    all.push_back({name, sample, fault});
  };
  add("NaN position", GuardFault::kNonFinite, [](auto& s) { s.tip_position_mm.y = kNan; });
  add("infinite position", GuardFault::kNonFinite, [](auto& s) { s.tip_position_mm.x = HUGE_VAL; });
  add("NaN orientation", GuardFault::kNonFinite, [](auto& s) { s.tip_orientation.z = kNan; });
  add("NaN force", GuardFault::kNonFinite, [](auto& s) { s.sensor_force_n.z = kNan; });
  add("NaN torque", GuardFault::kNonFinite, [](auto& s) { s.sensor_torque_n_mm.x = kNan; });
  add("stale", GuardFault::kSensorStale, [](auto& s) { s.force_age_ns = 2'000'001; });
  add("saturated", GuardFault::kSensorSaturated,
      [](auto& s) { s.status = hal::sample_status::kForceSaturated; });
  add("sensor fault", GuardFault::kSensorFault, [](auto& s) { s.status = hal::sample_status::kForceFault; });
  add("device fault", GuardFault::kDeviceFault, [](auto& s) { s.status = hal::sample_status::kDeviceFault; });
  return all;
}

TEST(Guard, EveryFaultGivesZeroInTheSameTickAndStaysLatched) {
  for (const FaultCase& c : faults()) {
    Guard guard(limits(), 1000.0);
    TickRecord record;
    for (int i = 0; i < 10; ++i) pass(guard, {0.0, 0.0, 5.0}, {}, record);
    EXPECT_EQ(norm(pass(guard, {0.0, 0.0, 5.0}, c.sample, record)), 0.0) << c.name;
    EXPECT_EQ(record.guard_fault, c.fault) << c.name;
    for (int i = 0; i < 10; ++i) EXPECT_EQ(norm(pass(guard, {0.0, 0.0, 5.0}, {}, record)), 0.0) << c.name;
    EXPECT_EQ(record.guard_state, GuardState::kLatched) << c.name;
    EXPECT_EQ(record.guard_fault, c.fault) << c.name << ": the first cause is kept";
  }
}

TEST(Guard, ClearIsRefusedWhileTheFaultPersists) {
  for (const FaultCase& c : faults()) {
    Guard guard(limits(), 1000.0);
    TickRecord record;
    pass(guard, {}, c.sample, record);
    EXPECT_FALSE(guard.clear()) << c.name;
    pass(guard, {}, {}, record);
    EXPECT_TRUE(guard.clear()) << c.name;
    EXPECT_EQ(guard.state(), GuardState::kResuming) << c.name;
  }
}

TEST(Guard, NonFiniteCommandLatches) {
  for (const double bad : {kNan, HUGE_VAL, -HUGE_VAL}) {
    Guard guard(limits(), 1000.0);
    TickRecord record;
    EXPECT_EQ(norm(pass(guard, {0.0, bad, 1.0}, {}, record)), 0.0);
    EXPECT_EQ(record.guard_fault, GuardFault::kNonFinite);
  }
}

TEST(Guard, ResumesOverARamp) {
  Guard guard(limits(), 1000.0);
  TickRecord record;
  guard.raise(GuardFault::kStopped);
  EXPECT_EQ(norm(pass(guard, {0.0, 0.0, 5.0}, {}, record)), 0.0);
  EXPECT_EQ(record.guard_fault, GuardFault::kStopped);
  ASSERT_TRUE(guard.clear());
  for (int i = 1; i <= 100; ++i) {
    EXPECT_NEAR(pass(guard, {0.0, 0.0, 5.0}, {}, record).z, 5.0 * i / 100.0, 1e-9);
  }
  EXPECT_EQ(record.guard_state, GuardState::kRendering);
}

TEST(Guard, ASceneWithoutSensorIgnoresTheSensor) {
  GuardLimits l = limits();
  l.sensor_stale_after_ms = 0.0;
  Guard guard(l, 1000.0);
  TickRecord record;
  hal::RigSample sample;
  sample.status = hal::sample_status::kForceMissing | hal::sample_status::kForceFault;
  sample.force_age_ns = 1'000'000'000;
  sample.sensor_force_n.x = kNan;
  EXPECT_GT(pass(guard, {0.0, 0.0, 1.0}, sample, record).z, 0.9);
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
    if (record.guard_state != GuardState::kLatched) {
      ASSERT_LE(norm(force - before), 1.7 + 1e-9);
    }
    before = force;
    if (kind(random) < 4) guard.clear();
  }
}

}  // namespace
}  // namespace hapticd::rt
