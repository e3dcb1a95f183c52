// The arm's geometry: the Jacobian against differences, all against a description of the same arm by other
// means.

#include "hal/phantom/kinematics.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

#include "hal/phantom/phantom_config.h"
#include "tests/emulators/board/arm_emulator.h"
#include "tests/support/turn.h"

namespace hapticd::phantom {
namespace {

using test::turned;

double length(const hal::Vector3& v) {
  return std::sqrt(dot(v, v));
}

/// Poses all over the joint space within the stops: a grid, and at random up to the stops themselves.
std::vector<JointAngles> poses_within_stops(const ArmGeometry& arm) {
  std::vector<JointAngles> poses;
  const auto add = [&](const JointAngles& q) {
    if (beyond_stops_rad(arm, q) <= 0.0) poses.push_back(q);
  };
  constexpr int kSteps = 24;
  const auto at = [&](std::size_t i, int k) {
    return arm.low_rad[i] + (arm.high_rad[i] - arm.low_rad[i]) * k / kSteps;
  };
  for (int a = 0; a <= kSteps; ++a) {
    for (int b = 0; b <= kSteps; ++b) {
      for (int c = 0; c <= kSteps; ++c) add({at(0, a), at(1, b), at(2, c)});
    }
  }
  std::mt19937_64 random(7);
  std::uniform_real_distribution<double> share(0.0, 1.0);
  while (poses.size() < 40'000) {
    JointAngles q{};
    for (std::size_t i = 0; i < 3; ++i) {
      q[i] = arm.low_rad[i] + (arm.high_rad[i] - arm.low_rad[i]) * share(random);
    }
    add(q);
  }
  return poses;
}

TEST(Kinematics, AtTheResetPoseTheFirstLinkIsLevelAndTheSecondHangs) {
  const PhantomConfig config;
  const hal::Vector3 tip = forward_mm(config.arm, {0.0, 0.0, 0.0});
  EXPECT_DOUBLE_EQ(tip.x, 215.0);
  EXPECT_DOUBLE_EQ(tip.y, 0.0);
  EXPECT_DOUBLE_EQ(tip.z, -170.0);
}

TEST(Kinematics, JacobianIsTheSlopeOfForward) {
  for (const std::string& model : phantom_presets()) {
    const ArmGeometry arm = phantom_preset(model)->arm;
    constexpr double kStep = 1e-5;
    double worst = 0.0;
    for (const JointAngles& q : poses_within_stops(arm)) {
      const Jacobian j = jacobian(arm, q);
      for (std::size_t i = 0; i < 3; ++i) {
        JointAngles ahead = q;
        JointAngles behind = q;
        ahead[i] += kStep;
        behind[i] -= kStep;
        const hal::Vector3 slope = (forward_mm(arm, ahead) - forward_mm(arm, behind)) * (1.0 / (2.0 * kStep));
        worst = std::max(worst, length(slope - hal::Vector3{j[0][i], j[1][i], j[2][i]}));
      }
    }
    EXPECT_LT(worst, 1e-6) << model << ": of some 200 mm/rad; differences lose l h²/6 + 1e-13/h";
  }
}

TEST(Kinematics, AgreesWithTheSameArmDescribedByOtherMeans) {
  const ArmGeometry arm = PhantomConfig{}.arm;
  const emulators::ArmEmulator other{emulators::ArmDescription{}};
  for (const JointAngles& q : poses_within_stops(arm)) {
    const hal::Vector3 tip = forward_mm(arm, q);
    EXPECT_LT(length(other.tip_mm(q) - tip), 1e-10);
    if (std::hypot(tip.x, tip.y) < 1.0 || std::abs(tip.x) < 1e-6) continue;
    const auto joints = other.joints(tip);
    for (std::size_t i = 0; i < 3; ++i)
      EXPECT_NEAR(joints[i], q[i], 1e-6) << q[0] << " " << q[1] << " " << q[2];
  }
}

TEST(Kinematics, TorquesDoTheForcesWork) {
  const ArmGeometry arm = PhantomConfig{}.arm;
  const JointAngles q{0.3, 0.4, 0.2};
  const hal::Vector3 force{1.0, -2.0, 3.0};
  const auto torque = torques_for_n_mm(arm, q, force);
  constexpr double kStep = 1e-5;
  for (std::size_t i = 0; i < 3; ++i) {
    JointAngles ahead = q;
    JointAngles behind = q;
    ahead[i] += kStep;
    behind[i] -= kStep;
    const double work = dot(force, forward_mm(arm, ahead) - forward_mm(arm, behind));
    EXPECT_NEAR(torque[i], work / (2.0 * kStep), 1e-5);
  }
}

TEST(Kinematics, StopsAreReported) {
  const ArmGeometry arm = PhantomConfig{}.arm;
  EXPECT_LT(beyond_stops_rad(arm, {0.0, 0.0, 0.0}), 0.0);
  const auto beyond_deg = [&](double q1, double q2, double q3) {
    return beyond_stops_rad(arm, {q1 * kRadPerDegree, q2 * kRadPerDegree, q3 * kRadPerDegree}) /
           kRadPerDegree;
  };
  EXPECT_NEAR(beyond_deg(95.0, 0.0, 0.0), 5.0, 1e-9);
  EXPECT_NEAR(beyond_deg(-91.0, 0.0, 0.0), 1.0, 1e-9);
  EXPECT_NEAR(beyond_deg(0.0, 121.0, 100.0), 2.0, 1e-9);
  EXPECT_NEAR(beyond_deg(0.0, -20.0, -32.0), 3.0, 1e-9);
  EXPECT_NEAR(beyond_deg(0.0, 70.0, 0.0), 5.0, 1e-9) << "q2 - q3";
  EXPECT_NEAR(beyond_deg(0.0, 0.0, 56.0), 1.0, 1e-9) << "q3 - q2";
}

TEST(Kinematics, TheGimbalTurnsWithTheSecondLink) {
  const ArmGeometry arm = PhantomConfig{}.arm;
  const JointAngles q{0.5, 0.2, 0.7};
  const hal::Quaternion o = orientation(q, {0.0, 0.0, 0.0});
  EXPECT_NEAR(o.w * o.w + o.x * o.x + o.y * o.y + o.z * o.z, 1.0, 1e-12);
  // What hangs along the second link at the reset pose points along it at any.
  const hal::Vector3 elbow{arm.first_link_mm * std::cos(q[1]) * std::cos(q[0]),
                           arm.first_link_mm * std::cos(q[1]) * std::sin(q[0]),
                           arm.first_link_mm * std::sin(q[1])};
  const hal::Vector3 along = (forward_mm(arm, q) - elbow) * (1.0 / arm.second_link_mm);
  EXPECT_LT(length(turned(o, {0.0, 0.0, -1.0}) - along), 1e-12);
  // The gimbal's first angle turns about the second link and leaves that direction alone.
  EXPECT_LT(length(turned(orientation(q, {1.1, 0.0, 0.0}), {0.0, 0.0, -1.0}) - along), 1e-12);
  // Its last one turns about the stylus, x at the reset pose.
  EXPECT_LT(length(turned(orientation({}, {0.0, 0.0, 0.9}), {1.0, 0.0, 0.0}) - hal::Vector3{1.0, 0.0, 0.0}),
            1e-12);
  EXPECT_LT(length(turned(orientation({}, {0.0, std::numbers::pi / 2.0, 0.0}), {1.0, 0.0, 0.0}) -
                   hal::Vector3{0.0, 0.0, -1.0}),
            1e-12);
}

}  // namespace
}  // namespace hapticd::phantom
