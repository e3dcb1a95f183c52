// Two masses on the device's structure: exactness, modes.

#include "hal/sim/device/axis_dynamics.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>

#include "hal/sim/device/device_model.h"

namespace hapticd::sim {
namespace {

const AxisParameters kHeld{.motor_mass_kg = 0.06,
                           .tip_mass_kg = 0.055,
                           .structural_stiffness_n_per_mm = 3.5,
                           .structural_damping_n_s_per_mm = 4e-4,
                           .motor_viscosity_n_s_per_mm = 2e-5,
                           .hand_stiffness_n_per_mm = 0.5,
                           .hand_damping_n_s_per_mm = 4e-3};
const AxisState kStruck{1.0, -30.0, 0.4, 120.0};

/// No hand holds it and nothing in it damps: whole motion has no restoring force.
const AxisParameters kFree{.motor_mass_kg = 0.06, .tip_mass_kg = 0.055, .structural_stiffness_n_per_mm = 3.5};

void expect_near(const AxisState& a, const AxisState& b, double relative) {
  EXPECT_NEAR(a.motor_mm, b.motor_mm, relative * 1.0);
  EXPECT_NEAR(a.tip_mm, b.tip_mm, relative * 1.0);
  EXPECT_NEAR(a.motor_mm_per_s, b.motor_mm_per_s, relative * 100.0);
  EXPECT_NEAR(a.tip_mm_per_s, b.tip_mm_per_s, relative * 100.0);
}

TEST(AxisDynamics, OneLongStepIsTenShortOnes) {
  const AxisDynamics coarse(kHeld, 1e-3), fine(kHeld, 1e-4);
  AxisState ten = kStruck;
  for (int i = 0; i < 10; ++i) ten = fine.advance(ten, 2.0, -1.5);
  expect_near(coarse.advance(kStruck, 2.0, -1.5), ten, 1e-12);
}

TEST(AxisDynamics, SolvesTheEquationsOfMotion) {
  // Newton's second law for both masses, by Runge-Kutta of fourth order in steps of 1 µs.
  constexpr double kMotorN = 2.0, kTipN = -1.5, kH = 1e-6;
  using Values = std::array<double, 4>;
  const auto rate = [&](const AxisParameters& p, const Values& s) {
    const double structure =
        p.structural_stiffness_n_per_mm * (s[2] - s[0]) + p.structural_damping_n_s_per_mm * (s[3] - s[1]);
    const double hand = -p.hand_stiffness_n_per_mm * s[2] - p.hand_damping_n_s_per_mm * s[3];
    return Values{s[1],
                  (kMotorN + structure - p.motor_viscosity_n_s_per_mm * s[1]) / (1e-3 * p.motor_mass_kg),
                  s[3], (kTipN - structure + hand) / (1e-3 * p.tip_mass_kg)};
  };
  const auto plus = [](const Values& a, const Values& b, double factor) {
    Values sum{};
    for (std::size_t i = 0; i < 4; ++i) sum[i] = a[i] + factor * b[i];
    return sum;
  };
  for (const AxisParameters& p : {kHeld, kFree}) {
    Values s{kStruck.motor_mm, kStruck.motor_mm_per_s, kStruck.tip_mm, kStruck.tip_mm_per_s};
    for (int i = 0; i < 5000; ++i) {
      const Values k1 = rate(p, s), k2 = rate(p, plus(s, k1, 0.5 * kH)), k3 = rate(p, plus(s, k2, 0.5 * kH)),
                   k4 = rate(p, plus(s, k3, kH));
      s = plus(plus(plus(plus(s, k1, kH / 6.0), k2, kH / 3.0), k3, kH / 3.0), k4, kH / 6.0);
    }
    AxisState exact = kStruck;
    const AxisDynamics dynamics(p, 1e-4);
    for (int i = 0; i < 50; ++i) exact = dynamics.advance(exact, kMotorN, kTipN);
    expect_near(exact, {s[0], s[1], s[2], s[3]}, 1e-9);
  }
}

TEST(AxisDynamics, ForcesAddedAfterwardsSuperpose) {
  const AxisDynamics dynamics(kHeld, 1e-4);
  AxisState added = dynamics.advance(kStruck, 0.5, 0.0);
  dynamics.add_motor_force(added, 1.5);
  dynamics.add_tip_force(added, -1.5);
  expect_near(added, dynamics.advance(kStruck, 2.0, -1.5), 1e-14);
}

TEST(AxisDynamics, AShortPushMovesOnlyTheMassItActsOn) {
  const AxisDynamics dynamics(kHeld, 1e-5);
  EXPECT_NEAR(dynamics.tip_position_per_tip_force() / (0.5 * 1e-10 / (1e-3 * kHeld.tip_mass_kg)), 1.0, 1e-3);
  EXPECT_NEAR(dynamics.motor_velocity_per_motor_force() / (1e-5 / (1e-3 * kHeld.motor_mass_kg)), 1.0, 1e-3);
}

class BareDevice : public testing::TestWithParam<std::string> {};

TEST_P(BareDevice, SwingsAtItsStructuralMode) {
  DeviceModel device = *device_preset(GetParam());
  for (const double mode_hz : {device.structural_mode_hz, 150.0, 220.0}) {
    device.structural_mode_hz = mode_hz;
    const AxisParameters p{.motor_mass_kg = device.motor_side_mass_kg(),
                           .tip_mass_kg = device.tip_side_mass_kg(),
                           .structural_stiffness_n_per_mm = device.structural_stiffness_n_per_mm};
    EXPECT_NEAR(p.motor_mass_kg + p.tip_mass_kg, device.apparent_mass_kg, 1e-15);
    EXPECT_GT(p.tip_mass_kg, 0.0);
    EXPECT_GE(p.motor_mass_kg, p.tip_mass_kg) << "motors are the heavier side";

    constexpr double kStepS = 1e-5;
    const AxisDynamics dynamics(p, kStepS);
    AxisState s{0.0, 0.0, 1.0, 0.0};
    double first_s = -1.0, last_s = -1.0;  // upward zero crossings of the stretch
    int cycles = -1;
    for (int i = 1; cycles < 100; ++i) {
      const double before_mm = s.tip_mm - s.motor_mm;
      s = dynamics.advance(s, 0.0, 0.0);
      const double after_mm = s.tip_mm - s.motor_mm;
      if (before_mm < 0.0 && after_mm >= 0.0) {
        last_s = kStepS * (i - after_mm / (after_mm - before_mm));
        if (++cycles == 0) first_s = last_s;
      }
    }
    EXPECT_NEAR(100.0 / (last_s - first_s) / mode_hz, 1.0, 1e-6) << mode_hz << " Hz";
  }
}

INSTANTIATE_TEST_SUITE_P(Presets, BareDevice, testing::Values("phantom_1_0", "phantom_1_5_high_force"),
                         [](const auto& tested) { return tested.param; });

}  // namespace
}  // namespace hapticd::sim
