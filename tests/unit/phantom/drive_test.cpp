// Encoders, cables, motors and amplifiers: resolution, stall force, volts and back.

#include "hal/phantom/drive.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "tests/emulators/board/arm_emulator.h"

namespace hapticd::phantom {
namespace {

/// The force along x, y and z, each alone, that the currents can hold in this pose, N: the weakest joint
/// decides.
std::array<double, 3> axis_forces_n(const PhantomConfig& config, const JointAngles& q,
                                    const Currents& current_a) {
  std::array<double, 3> forces{};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const hal::Vector3 one{axis == 0 ? 1.0 : 0.0, axis == 1 ? 1.0 : 0.0, axis == 2 ? 1.0 : 0.0};
    const Currents needed_a = Drive(config).currents_for(torques_for_n_mm(config.arm, q, one));
    forces[axis] = std::numeric_limits<double>::infinity();
    for (std::size_t i = 0; i < 3; ++i) {
      if (needed_a[i] != 0.0) forces[axis] = std::min(forces[axis], std::abs(current_a[i] / needed_a[i]));
    }
  }
  return forces;
}

TEST(Drive, ResolutionAtTheResetPoseIsTheDataSheets) {
  EXPECT_NEAR(tip_resolution_mm(*phantom_preset("phantom_premium_1_5"), {}), 0.03, 0.001);
  EXPECT_NEAR(tip_resolution_mm(*phantom_preset("phantom_premium_1_5_high_force"), {}), 0.007, 0.0005);
  EXPECT_NEAR(tip_resolution_mm(*phantom_preset("phantom_premium_1_0"), {}), 0.03, 0.007)
      << "what is assumed of its cables must not contradict the sheet's nominal figure";
  // One count of each joint alone, 1.5: l / (4096 n / 2π).
  const Drive drive{PhantomConfig{}};
  EXPECT_NEAR(215.0 * drive.rad_per_count()[0], 0.0248, 1e-4);
  EXPECT_NEAR(215.0 * drive.rad_per_count()[1], 0.0294, 1e-4);
  EXPECT_NEAR(170.0 * drive.rad_per_count()[2], 0.0233, 1e-4);
}

TEST(Drive, StallForceAtTheResetPose) {
  const PhantomConfig config;
  const Currents stall{129.0 / 23.4, 129.0 / 23.4, 129.0 / 23.4};
  const auto along = axis_forces_n(config, {}, stall);
  EXPECT_NEAR(along[0], 129.0 * 11.2 / 170.0, 1e-9);  // 8.50 N
  EXPECT_NEAR(along[1], 129.0 * 13.3 / 215.0, 1e-9);  // 7.98 N
  EXPECT_NEAR(along[2], 129.0 * 11.2 / 215.0, 1e-9);  // 6.72 N
  EXPECT_NEAR(*std::max_element(along.begin(), along.end()), 8.5, 0.05);
  EXPECT_NEAR(force_in_any_direction_n(config, {}, stall), *std::min_element(along.begin(), along.end()),
              1e-9);
}

TEST(Drive, PresetsHoldTheForcesOfTheirDataSheets) {
  for (const std::string& model : phantom_presets()) {
    const PhantomConfig config = *phantom_preset(model);
    const auto peak = axis_forces_n(config, config.reset_pose_rad, config.peak_current_a);
    const auto held = axis_forces_n(config, config.reset_pose_rad, config.continuous_current_a);
    EXPECT_GE(*std::max_element(peak.begin(), peak.end()), 0.99 * config.max_force_n) << model;
    EXPECT_NEAR(*std::min_element(held.begin(), held.end()), config.max_continuous_force_n,
                0.01 * config.max_continuous_force_n)
        << model;
    for (std::size_t i = 0; i < 3; ++i) {
      EXPECT_LE(config.peak_current_a[i], 10.0 * config.amplifier_gain_a_per_v[i]) << "within ± 10 V";
    }
  }
}

TEST(Drive, VoltsMakeThatForceAtTheTipOfAnotherDescriptionOfTheArm) {
  const PhantomConfig config;
  const Drive drive(config);
  const emulators::ArmEmulator arm{emulators::ArmDescription{}};
  for (const JointAngles& q :
       {JointAngles{0.0, 0.0, 0.0}, JointAngles{0.7, 0.5, 0.2}, JointAngles{-1.2, -0.3, 0.3}}) {
    const hal::Vector3 force{0.5, -1.5, 2.5};
    const hal::Vector3 made =
        arm.tip_force_n(q, drive.volts_for(drive.currents_for(torques_for_n_mm(config.arm, q, force))));
    EXPECT_NEAR(made.x, force.x, 1e-6);
    EXPECT_NEAR(made.y, force.y, 1e-6);
    EXPECT_NEAR(made.z, force.z, 1e-6);
  }
}

TEST(Drive, CountsAreTurnsOfTheJoints) {
  const Drive drive({.encoder_sign = {1.0, 1.0, -1.0}});
  const JointAngles turn = drive.turn_rad({4096 + 10, 10, -4096}, {10, 10, 0});
  EXPECT_NEAR(turn[0], 2.0 * std::numbers::pi / 13.3, 1e-12);
  EXPECT_EQ(turn[1], 0.0);
  EXPECT_NEAR(turn[2], 2.0 * std::numbers::pi / 11.2, 1e-12);
}

}  // namespace
}  // namespace hapticd::phantom
