// Two masses on the device's structure: exactness, conservation, modes.

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

AxisParameters free_and_undamped(const AxisParameters& p) {
  return {.motor_mass_kg = p.motor_mass_kg,
          .tip_mass_kg = p.tip_mass_kg,
          .structural_stiffness_n_per_mm = p.structural_stiffness_n_per_mm};
}

void expect_near(const AxisState& a, const AxisState& b, double relative) {
  EXPECT_NEAR(a.motor_mm, b.motor_mm, relative * 1.0);
  EXPECT_NEAR(a.tip_mm, b.tip_mm, relative * 1.0);
  EXPECT_NEAR(a.motor_mm_per_s, b.motor_mm_per_s, relative * 100.0);
  EXPECT_NEAR(a.tip_mm_per_s, b.tip_mm_per_s, relative * 100.0);
}

/// kg · mm²/s² = 1e-3 N·mm.
double kinetic_n_mm(double mass_kg, double velocity_mm_per_s) {
  return 0.5e-3 * mass_kg * velocity_mm_per_s * velocity_mm_per_s;
}

double energy_n_mm(const AxisParameters& p, const AxisState& s) {
  const double stretch = s.tip_mm - s.motor_mm;
  return kinetic_n_mm(p.motor_mass_kg, s.motor_mm_per_s) + kinetic_n_mm(p.tip_mass_kg, s.tip_mm_per_s) +
         0.5 * p.structural_stiffness_n_per_mm * stretch * stretch +
         0.5 * p.hand_stiffness_n_per_mm * s.tip_mm * s.tip_mm;
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
  const auto rate = [&](const Values& s) {
    const double structure = kHeld.structural_stiffness_n_per_mm * (s[2] - s[0]) +
                             kHeld.structural_damping_n_s_per_mm * (s[3] - s[1]);
    const double hand = -kHeld.hand_stiffness_n_per_mm * s[2] - kHeld.hand_damping_n_s_per_mm * s[3];
    return Values{
        s[1], (kMotorN + structure - kHeld.motor_viscosity_n_s_per_mm * s[1]) / (1e-3 * kHeld.motor_mass_kg),
        s[3], (kTipN - structure + hand) / (1e-3 * kHeld.tip_mass_kg)};
  };
  const auto plus = [](const Values& a, const Values& b, double factor) {
    Values sum{};
    for (std::size_t i = 0; i < 4; ++i) sum[i] = a[i] + factor * b[i];
    return sum;
  };
  Values s{kStruck.motor_mm, kStruck.motor_mm_per_s, kStruck.tip_mm, kStruck.tip_mm_per_s};
  for (int i = 0; i < 5000; ++i) {
    const Values k1 = rate(s), k2 = rate(plus(s, k1, 0.5 * kH)), k3 = rate(plus(s, k2, 0.5 * kH)),
                 k4 = rate(plus(s, k3, kH));
    s = plus(plus(plus(plus(s, k1, kH / 6.0), k2, kH / 3.0), k3, kH / 3.0), k4, kH / 6.0);
  }
  AxisState exact = kStruck;
  const AxisDynamics dynamics(kHeld, 1e-4);
  for (int i = 0; i < 50; ++i) exact = dynamics.advance(exact, kMotorN, kTipN);
  expect_near(exact, {s[0], s[1], s[2], s[3]}, 1e-9);
}

TEST(AxisDynamics, ConservesEnergyWithoutDamping) {
  AxisParameters p = free_and_undamped(kHeld);
  p.hand_stiffness_n_per_mm = 0.5;
  const AxisDynamics dynamics(p, 1e-4);
  AxisState s = kStruck;
  const double start_n_mm = energy_n_mm(p, s);
  for (int i = 0; i < 100'000; ++i) s = dynamics.advance(s, 0.0, 0.0);
  EXPECT_NEAR(energy_n_mm(p, s) / start_n_mm, 1.0, 1e-9);
}

TEST(AxisDynamics, OnlyLosesEnergyWithDamping) {
  const AxisDynamics dynamics(kHeld, 1e-4);
  AxisState s = kStruck;
  for (int i = 0; i < 2000; ++i) {
    const double before_n_mm = energy_n_mm(kHeld, s);
    s = dynamics.advance(s, 0.0, 0.0);
    EXPECT_LT(energy_n_mm(kHeld, s), before_n_mm);
  }
}

TEST(AxisDynamics, MomentumChangesByTheOuterForcesOnly) {
  const AxisParameters p = free_and_undamped(kHeld);
  const AxisDynamics dynamics(p, 1e-4);
  const auto momentum_n_s = [&](const AxisState& s) {
    return 1e-3 * (p.motor_mass_kg * s.motor_mm_per_s + p.tip_mass_kg * s.tip_mm_per_s);
  };
  AxisState s = kStruck;
  double expected_n_s = momentum_n_s(s);
  for (int i = 0; i < 5000; ++i) {
    const double motor_n = 1.3 * std::sin(0.01 * i), tip_n = i % 7 == 0 ? -2.0 : 0.4;
    s = dynamics.advance(s, motor_n, tip_n);
    expected_n_s += (motor_n + tip_n) * 1e-4;
    ASSERT_NEAR(momentum_n_s(s), expected_n_s, 1e-12);
  }
}

TEST(AxisDynamics, BendsByForceOverStructuralStiffness) {
  AxisParameters p = kHeld;
  p.hand_stiffness_n_per_mm = p.hand_damping_n_s_per_mm = p.motor_viscosity_n_s_per_mm = 0.0;
  const AxisDynamics dynamics(p, 1e-4);
  AxisState s;
  for (int i = 0; i < 100'000; ++i) s = dynamics.advance(s, 7.0, -7.0);
  EXPECT_NEAR(s.motor_mm - s.tip_mm, 7.0 / p.structural_stiffness_n_per_mm, 1e-9);
}

TEST(AxisDynamics, MotorViscosityLimitsTheSpeed) {
  AxisParameters p = kHeld;
  p.hand_stiffness_n_per_mm = p.hand_damping_n_s_per_mm = 0.0;
  p.motor_viscosity_n_s_per_mm = 1e-3;
  const AxisDynamics dynamics(p, 1e-3);
  AxisState s;
  for (int i = 0; i < 10'000; ++i) s = dynamics.advance(s, 0.2, 0.0);
  EXPECT_NEAR(s.motor_mm_per_s, 200.0, 1e-6);
  EXPECT_NEAR(s.tip_mm_per_s, 200.0, 1e-6);
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
