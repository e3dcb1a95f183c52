// The truth that estimates are judged by agrees with itself and with Newton.

#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <tuple>

#include "hal/sim/object/shape.h"
#include "tests/unit/sim/virtual_rig.h"

namespace hapticd::sim {
namespace {

using hal::Vector3;
using test::length;
using test::VirtualRig;

class Truth : public testing::TestWithParam<std::string> {};
INSTANTIATE_TEST_SUITE_P(Objects, Truth, testing::ValuesIn(object_preset_names()),
                         [](const auto& tested) { return tested.param; });

HandProgram stroking() {
  return {.kind = HandProgram::Kind::kStroke,
          .force_n = 2.0,
          .force_rate_n_per_s = 4.0,
          .speed_mm_per_s = 60.0,
          .repetitions = -1,
          .stroke_length_mm = 20.0};
}

TEST_P(Truth, ReactionIsNormalForcePlusFriction) {
  VirtualRig rig({.object = GetParam()}, stroking());
  int touching = 0;
  rig.run(8.0, [&] {
    const hal::TruthSample& t = rig.truth();
    ASSERT_NEAR(length(t.outward_normal), 1.0, 1e-12);
    ASSERT_NEAR(dot(t.reaction_force_n, t.outward_normal), t.normal_force_n, 1e-9);
    const Vector3 tangential_n = t.reaction_force_n - t.outward_normal * t.normal_force_n;
    ASSERT_NEAR(length(tangential_n), t.friction_force_n, 1e-9);
    ASSERT_GE(t.normal_force_n, 0.0);
    ASSERT_GE(t.displacement_mm, 0.0);
    if (t.in_contact) {
      ++touching;
    } else {
      ASSERT_EQ(length(t.reaction_force_n), 0.0);
    }
  });
  EXPECT_GT(touching, 1000);
}

TEST_P(Truth, FrictionOpposesSlidingAndStaysBelowItsStaticLevel) {
  VirtualRig rig({.object = GetParam()}, stroking());
  const FrictionParameters p = object_preset(GetParam())->friction;
  Vector3 last_mm;
  rig.run(8.0, [&] {
    const hal::TruthSample& t = rig.truth();
    const Vector3 moved_mm = t.tip_position_mm - last_mm;
    last_mm = t.tip_position_mm;
    if (!t.in_contact || t.normal_force_n < 0.5) return;
    // Static level, bristle damping and viscosity: a tenth covers what the normal force moves in a step.
    ASSERT_LE(t.friction_force_n,
              1.1 * p.kinetic * p.static_ratio * (1.0 + p.ripple_share) * t.normal_force_n);
    const Vector3 slide_mm = moved_mm - t.outward_normal * dot(moved_mm, t.outward_normal);
    const double power = dot(t.reaction_force_n - t.outward_normal * t.normal_force_n, slide_mm);
    if (length(slide_mm) > 0.03) {
      ASSERT_LT(power, 0.3 * t.friction_force_n * length(slide_mm)) << rig.time_s();
    }
  });
}

TEST_P(Truth, DisplacementIsTheDepthOfTheTip) {
  VirtualRig rig({.object = GetParam()}, stroking());
  const Shape shape = object_preset(GetParam())->shape;
  rig.run(8.0, [&] {
    const hal::TruthSample& t = rig.truth();
    if (!t.in_contact) return;
    const Vector3& tip = t.tip_position_mm;
    // Contact point, normal and depth lead to the tip …
    ASSERT_LT(length(t.undeformed_contact_mm - t.outward_normal * t.displacement_mm - tip), 5e-3);
    // … and are those of the undeformed shape.
    if (std::holds_alternative<Plane>(shape)) {
      ASSERT_NEAR(t.displacement_mm, -tip.z, 1e-9);
    } else if (const auto* sphere = std::get_if<Sphere>(&shape)) {
      const Vector3 centre{0.0, 0.0, -sphere->radius_mm};
      ASSERT_NEAR(t.displacement_mm, sphere->radius_mm - length(tip - centre), 1e-4);
      ASSERT_NEAR(length(t.undeformed_contact_mm - centre), sphere->radius_mm, 1e-9);
    } else {
      ASSERT_NEAR(t.displacement_mm, project(shape, tip).depth_mm, 1e-4);
    }
    ASSERT_GE(t.surface_depression_mm, t.displacement_mm - 1e-6) << "the tip is in its own dent";
  });
}

TEST_P(Truth, TheDentIsThereUntilItHasRecovered) {
  VirtualRig rig(
      {.object = GetParam()},
      {.kind = HandProgram::Kind::kPress, .force_n = 3.0, .force_rate_n_per_s = 10.0, .hold_s = 1.0});
  bool pressed = false, dented_without_contact = false;
  rig.run(30.0, [&] {
    pressed = pressed || rig.truth().normal_force_n > 2.0;
    if (pressed && !rig.truth().in_contact && rig.truth().surface_depression_mm > 1e-4) {
      dented_without_contact = true;
      ASSERT_EQ(rig.truth().normal_force_n, 0.0);
    }
  });
  EXPECT_TRUE(pressed);
  // Wood creeps so little and so fast that the leaving tip does not outrun it measurably.
  if (GetParam() != "wood_plate") {
    EXPECT_TRUE(dented_without_contact);
  }
  EXPECT_LT(rig.truth().surface_depression_mm, 0.05);
}

// Every direction of force and both devices; both devices with the largest.
using Balanced = std::tuple<std::string, double>;
class Balance : public testing::TestWithParam<Balanced> {};
INSTANTIATE_TEST_SUITE_P(
    Devices, Balance,
    testing::Values(Balanced{"phantom_1_0", -2.0}, Balanced{"phantom_1_5_high_force", -2.0},
                    Balanced{"phantom_1_0", 0.0}, Balanced{"phantom_1_5_high_force", 1.5}),
    [](const auto& tested) {
      const double force_n = std::get<1>(tested.param);
      return std::get<0>(tested.param) + (force_n < 0.0 ? "_down" : force_n > 0.0 ? "_up" : "_off");
    });

TEST_P(Balance, AtRestHandDeviceAndObjectCancelButForTheDevicesFriction) {
  const auto& [device, force_n] = GetParam();
  const double friction_n = device_preset(device)->coulomb_friction_n;
  for (const char* object : {"sponge_block", "foam_ball", "silicone_rest", "wood_plate"}) {
    VirtualRig rig({.device = device, .object = object}, {.kind = HandProgram::Kind::kWeight});
    rig.run(6.0);
    rig.run(8.0, {0.2 * force_n, 0.0, force_n});
    rig.run(0.2,
            [&] {
              const hal::TruthSample& t = rig.truth();
              const Vector3 rest_n = t.hand_force_n + t.device_force_n + t.reaction_force_n;
              ASSERT_LE(std::abs(rest_n.x), friction_n + 5e-3) << object;
              ASSERT_LE(std::abs(rest_n.y), friction_n + 5e-3) << object;
              ASSERT_LE(std::abs(rest_n.z), friction_n + 5e-3) << object;
            },
            {0.2 * force_n, 0.0, force_n});
  }
}

TEST(Truth, InMotionForcesMakeTheMomentumOfToolAndDevice) {
  // Impulse of all outer forces over a stroke of tapping = change of momentum of the moving masses (both at
  // rest before and after), but for the friction of the motors.
  VirtualRig rig(
      {.object = "rubber_ball", .rate_hz = 10000.0},
      {.kind = HandProgram::Kind::kTap, .speed_mm_per_s = 300.0, .rate_hz = 1.0, .repetitions = 1});
  const DeviceModel device = *device_preset("phantom_1_0");
  const double mass_kg = device.apparent_mass_kg + device.sensor_mass_kg + 0.00935;
  double momentum_n_s = 0.0, last_mm = 10.0;
  double bound_n_s = 0.0, max_n_s = 0.0;
  rig.run(1.5, [&] {
    const hal::TruthSample& t = rig.truth();
    momentum_n_s += 1e-4 * (t.hand_force_n.z + t.device_force_n.z + t.reaction_force_n.z);
    bound_n_s += 1e-4 * (device.coulomb_friction_n + 5e-6 * 500.0);
    const double actual_n_s = 1e-3 * mass_kg * (t.tip_position_mm.z - last_mm) / 1e-4;
    last_mm = t.tip_position_mm.z;
    // The structure lets the motor side lag: a share of the momentum of one swing.
    ASSERT_NEAR(momentum_n_s, actual_n_s, bound_n_s + 0.03);
    max_n_s = std::max(max_n_s, std::abs(actual_n_s));
  });
  EXPECT_GT(max_n_s, 0.02);
}

}  // namespace
}  // namespace hapticd::sim
