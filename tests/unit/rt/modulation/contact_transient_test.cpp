#include "rt/modulation/contact_transient.h"

#include <gtest/gtest.h>

#include <cmath>
#include <complex>
#include <limits>

#include "rt/signal/vector.h"

namespace hapticd::rt {
namespace {

using hal::Vector3;

constexpr double kRateHz = 5000.0;
constexpr double kFreeChangeN = 100.0;

GripPlant plant() {
  return grip_plant(GripDynamics{}, 75.0, 3.5, 12.59, 0.0);
}
TransientParameters wood() {
  return {.target = {{100.0, 80.0, 10.0}}};
}
ContactTransient::Input touching(double speed_mm_per_s, bool just_declared = false, double authority = 1.0) {
  return {true, just_declared, authority, speed_mm_per_s, {0.0, 0.0, 1.0}, {1.0 / kRateHz, 1.0, 1.0, false}};
}
ContactTransient::Input away() {
  return {false, false, 0.0, 0.0, {0.0, 0.0, 1.0}, {1.0 / kRateHz, 1.0, 1.0, false}};
}

struct Course {
  double peak_n = 0.0;
  double peak_change_n = 0.0;
  double length_s = 0.0;
};
Course run_course(ContactTransient& transient, double speed_mm_per_s) {
  Course course;
  double before = transient.update(touching(speed_mm_per_s, true)).z;
  for (int i = 1; i < 2000; ++i) {
    const double now = transient.update(touching(0.0)).z;
    course.peak_n = std::max(course.peak_n, std::abs(now));
    course.peak_change_n = std::max(course.peak_change_n, std::abs(now - before));
    if (now != 0.0) course.length_s = i / kRateHz;
    before = now;
  }
  return course;
}

/// Two masses under a command, by small steps: what the tip's acceleration becomes.
TEST(TransientWaveform, TheDynamicsTurnItIntoTheAccelerationAskedFor) {
  const GripPlant p = plant();
  for (const double hz : {30.0, 100.0, 300.0}) {
    TransientWaveform waveform({.target = {{hz, 80.0, 1.0}}}, p, kRateHz);
    const SmoothMode mode = smooth_mode(hz, 80.0);
    waveform.restart();
    constexpr int kSubSteps = 200;
    const double step_s = 1.0 / (kRateHz * kSubSteps);
    double motor = 0.0, motor_v = 0.0, tip = 0.0, tip_v = 0.0, amplifier = 0.0;
    double difference = 0.0, size = 0.0;
    for (int tick = 0; tick < 300; ++tick) {
      const double command = waveform.force_n();
      for (int i = 0; i < kSubSteps; ++i) {
        amplifier += (command - amplifier) * p.amplifier_rad_per_s * step_s;
        const double spring = p.structure_n_per_m * (motor - tip);
        const double tip_a = (spring - p.grip_n_per_m * tip - p.grip_n_s_per_m * tip_v) / p.tip_mass_kg;
        motor_v += (amplifier - spring) / p.motor_mass_kg * step_s;
        tip_v += tip_a * step_s;
        motor += motor_v * step_s;
        tip += tip_v * step_s;
        if (i + 1 < kSubSteps) continue;
        const double t = (tick + 0.5) / kRateHz;  // a held command is half a tick late
        double wanted = 0.0;
        for (std::size_t j = 0; j < SmoothMode::kTerms; ++j) {
          wanted += 1e-3 * (mode.weight[j] * std::exp(mode.pole[j] * t)).imag();
        }
        difference += (tip_a - wanted) * (tip_a - wanted);
        size += wanted * wanted;
      }
      waveform.advance(1);
    }
    EXPECT_LT(std::sqrt(difference / size), 0.1) << hz;
  }
}

TEST(TransientWaveform, BeginsAtRestAndPeaksAtOne) {
  for (const double hz : {10.0, 100.0, 300.0}) {
    for (const double decay : {30.0, 1000.0}) {
      const SmoothMode mode = smooth_mode(hz, decay);
      for (int m = -2; m <= 3; ++m) {
        std::complex<double> sum;
        double size = 0.0;
        for (std::size_t j = 0; j < SmoothMode::kTerms; ++j) {
          sum += mode.weight[j] * std::pow(mode.pole[j], m);
          size += std::abs(mode.weight[j] * std::pow(mode.pole[j], m));
        }
        EXPECT_LT(std::abs(sum), 1e-6 * size) << hz << " Hz, " << decay << " 1/s, order " << m;
      }
    }
  }
}

TEST(TransientWaveform, LateTicksArriveWhereTheOthersDo) {
  TransientWaveform by_one(wood(), plant(), kRateHz), by_some(wood(), plant(), kRateHz);
  by_one.restart();
  by_some.restart();
  std::uint32_t at = 0;
  for (const std::uint32_t ticks : {1U, 3U, 25U, 31U, 7U, 2U}) {
    for (std::uint32_t i = 0; i < ticks; ++i) by_one.advance(1);
    by_some.advance(ticks);
    at += ticks;
    EXPECT_NEAR(by_one.force_n(), by_some.force_n(), 1e-12) << at;
  }
  by_some.advance(10'000);
  EXPECT_TRUE(by_some.is_over());
}

TEST(ContactTransient, GrowsWithTheSpeedUpToItsBounds) {
  ContactTransient slow(wood(), plant(), kFreeChangeN, kRateHz), fast(wood(), plant(), kFreeChangeN, kRateHz);
  const Course at_50 = run_course(slow, 50.0), at_100 = run_course(fast, 100.0);
  EXPECT_NEAR(at_100.peak_n / at_50.peak_n, 2.0, 1e-6);
  EXPECT_EQ(fast.amplitude_share(), 1.0);
  TransientParameters weak = wood();
  weak.max_force_n = 0.2;
  ContactTransient bounded(weak, plant(), kFreeChangeN, kRateHz);
  EXPECT_NEAR(run_course(bounded, 1000.0).peak_n, 0.2, 1e-3);
  EXPECT_LT(bounded.amplitude_share(), 1.0);
  ContactTransient gentle(wood(), plant(), 0.02, kRateHz);
  EXPECT_LT(run_course(gentle, 1000.0).peak_change_n, 0.0101);
}

TEST(ContactTransient, GivesNoMoreEnergyThanTheImpactBrought) {
  TransientParameters strong = wood();
  strong.target[0].gain_per_s = 1000.0;
  strong.max_force_n = 20.0;
  TransientWaveform waveform(strong, plant(), kRateHz);
  ContactTransient transient(strong, plant(), kFreeChangeN, kRateHz);
  run_course(transient, 20.0);
  const double speed = 20.0 * transient.amplitude_share();
  EXPECT_LE(waveform.peak_energy_mj() * speed * speed,
            1e-3 * 0.5 * plant().mass_kg() * 20.0 * 20.0 * (1.0 + 1e-9));
}

TEST(ContactTransient, IsOverAfterATenthOfASecond) {
  ContactTransient transient(wood(), plant(), kFreeChangeN, kRateHz);
  EXPECT_LE(run_course(transient, 200.0).length_s, 0.1);
  EXPECT_FALSE(transient.is_running());
}

TEST(ContactTransient, NothingBeforeTheEvidenceAndNothingOnABounce) {
  ContactTransient transient(wood(), plant(), kFreeChangeN, kRateHz);
  transient.update(touching(200.0, true, 0.0));
  for (int i = 0; i < 20; ++i) EXPECT_EQ(transient.update(touching(200.0, false, 0.0)).z, 0.0);
  transient.update(touching(200.0));
  EXPECT_TRUE(transient.is_running());
  EXPECT_EQ(transient.count(), 1U);
  for (int i = 0; i < 50; ++i) transient.update(away());  // authority is gone: so is the force
  EXPECT_FALSE(transient.is_running());
  run_course(transient, 200.0);
  EXPECT_EQ(transient.count(), 1U) << "10 ms later: the same impact";
  for (int i = 0; i < 500; ++i) transient.update(away());
  run_course(transient, 200.0);
  EXPECT_EQ(transient.count(), 2U);
  for (int i = 0; i < 500; ++i) transient.update(away());
  run_course(transient, 5.0);
  EXPECT_EQ(transient.count(), 2U) << "too slow";
}

TEST(ContactTransient, LateEvidenceIsNoImpactAnyMore) {
  ContactTransient transient(wood(), plant(), kFreeChangeN, kRateHz);
  transient.update(touching(200.0, true, 0.0));
  for (int i = 0; i < 200; ++i) transient.update(touching(200.0, false, 0.0));
  EXPECT_EQ(transient.update(touching(200.0)).z, 0.0);
  EXPECT_EQ(transient.count(), 0U);
}

TEST(ContactTransient, GapsAndWhatIsNoNumberEndIt) {
  ContactTransient transient(wood(), plant(), kFreeChangeN, kRateHz);
  constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
  for (int kind = 0; kind < 3; ++kind) {
    transient.reset();
    transient.update(touching(200.0, true));
    for (int i = 0; i < 20; ++i) transient.update(touching(0.0));
    ASSERT_NE(transient.force_n(), 0.0);
    ContactTransient::Input bad = touching(0.0);
    if (kind == 0) bad.interval.is_gap = true;
    if (kind == 1) bad.normal.x = kNaN;
    if (kind == 2) bad.authority = kNaN;
    EXPECT_EQ(norm(transient.update(bad)), 0.0);
    EXPECT_EQ(norm(transient.update(touching(0.0))), 0.0) << "and does not come back";
  }
}

TEST(ContactTransient, WhatTheObjectGivesIsSubtracted) {
  TransientParameters both = wood();
  both.real = both.target;
  ContactTransient nothing_left(both, plant(), kFreeChangeN, kRateHz);
  EXPECT_LT(run_course(nothing_left, 200.0).peak_n, 1e-9);
}

TEST(TransientParameters, AreCheckedByNameAndByTheRate) {
  EXPECT_FALSE(check(wood(), 1000.0, "transient.", "scene"));
  TransientParameters high = wood();
  high.target[0].frequency_hz = 200.0;
  const auto refused = check(high, 1000.0, "transient.", "scene");
  ASSERT_TRUE(refused);
  EXPECT_NE(refused->what.find("transient.mode[0].frequency_hz"), std::string::npos);
  EXPECT_FALSE(check(high, 5000.0, "transient.", "scene"));
  TransientParameters none;
  EXPECT_TRUE(check(none, 1000.0, "transient.", "scene"));
  TransientParameters bad = wood();
  bad.grip.grip_mass_g = std::numeric_limits<double>::quiet_NaN();
  EXPECT_TRUE(check(bad, 1000.0, "transient.", "scene"));
}

TEST(GripInverse, AStiffObjectAsksForMoreForceAtLowFrequencies) {
  // m s² + k of tip, hand and object: what accelerates the grip at 30 Hz has to bend an eraser as well.
  const std::complex<double> low{-80.0, 2.0 * M_PI * 30.0}, high{-80.0, 2.0 * M_PI * 300.0};
  const GripPlant soft = plant();
  const GripPlant stiff = grip_plant(GripDynamics{}, 75.0, 3.5, 12.59, 2.26);
  EXPECT_GT(std::abs(command_per_acceleration(stiff, low) / command_per_acceleration(soft, low) - 1.0), 0.3);
  EXPECT_LT(std::abs(command_per_acceleration(stiff, high) / command_per_acceleration(soft, high) - 1.0),
            0.05);
}

}  // namespace
}  // namespace hapticd::rt
