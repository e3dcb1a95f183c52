#include "rt/signal/tool_load.h"

#include "tests/unit/rt/deformation/directions.h"

namespace hapticd::rt {
namespace {

using namespace test;

constexpr double kLoadG = 12.59;
constexpr hal::Vector3 kGravityMmPerS2{0.0, 0.0, -ToolLoad::kGravityMmPerS2};

/// (4.5) as the sensor lives it: what it reads of a contact force and of the tool's motion, tool frame.
hal::RigSample measured(const hal::Quaternion& orientation, const hal::Quaternion& at_bias,
                        const hal::Vector3& reaction_n, const hal::Vector3& acceleration_mm_per_s2) {
  const auto mass_times = [](const hal::Vector3& a) { return a * (1e-6 * kLoadG); };
  hal::RigSample sample;
  sample.tip_orientation = orientation;
  sample.sensor_force_n =
      rotated(inverse(orientation), reaction_n + mass_times(kGravityMmPerS2 - acceleration_mm_per_s2)) -
      rotated(inverse(at_bias), mass_times(kGravityMmPerS2));
  return sample;
}
hal::Vector3 gravity_at(const hal::Quaternion& orientation) {
  return rotated(inverse(orientation), {0.0, 0.0, -1.0});
}

TEST(ToolLoad, WhatMotionAddsTheInertiaGivesBack) {
  std::mt19937_64 random(3);
  for (int i = 0; i < 2000; ++i) {
    const hal::Quaternion at_bias = random_rotation(random);
    const hal::Quaternion now = random_rotation(random);
    const hal::Vector3 reaction = random_vector(random, 1.0);
    const hal::Vector3 acceleration = random_vector(random, 2e4);
    const ToolLoad load(kLoadG, gravity_at(at_bias));
    const hal::Vector3 left = load.without_weight_n(measured(now, at_bias, reaction, acceleration));
    ASSERT_LT(norm(left - (reaction - acceleration * (1e-6 * kLoadG))), 1e-12) << "f_r - m a";
    ASSERT_LT(norm(left + load.inertia_n(acceleration) - reaction), 1e-12);
  }
}

TEST(ToolLoad, ATurnedAndBiasedSensorReadsTheSameContact) {
  const SensorMounting mounting{{20.0, -35.0, 90.0}, {0.3, -0.2, 0.5}};
  const hal::Quaternion seat = mounting.to_tool();
  const hal::Quaternion back{seat.w, -seat.x, -seat.y, -seat.z};
  const ToolLoad load = ToolLoad::mounted(kLoadG, mounting);
  const hal::Vector3 contact_n{0.4, 0.1, 2.0};
  const hal::Vector3 weight_n{0.0, 0.0, -1e-6 * kLoadG * ToolLoad::kGravityMmPerS2};
  hal::RigSample sample;
  sample.tip_orientation = unit({0.9, 0.2, -0.3, 0.1});
  const hal::Quaternion& q = sample.tip_orientation;
  const hal::Vector3 in_tool_n = rotated({q.w, -q.x, -q.y, -q.z}, contact_n + weight_n);
  sample.sensor_force_n = rotated(back, in_tool_n) + mounting.force_bias_n;
  const hal::Vector3 error_n = load.without_weight_n(sample) - contact_n;
  EXPECT_LT(norm(error_n), 1e-12);
}

TEST(ToolLoad, ATurnAndItsRotationAreTheSame) {
  for (const hal::Vector3& turn_deg : {hal::Vector3{}, hal::Vector3{1e-9, 0.0, 0.0},
                                       hal::Vector3{10.0, -20.0, 30.0}, hal::Vector3{0.0, 180.0, 0.0}}) {
    const hal::Vector3 again_deg = turn_deg_of(SensorMounting{turn_deg, {}}.to_tool());
    EXPECT_LT(norm(again_deg - turn_deg), 1e-9) << norm(turn_deg);
  }
}

}  // namespace
}  // namespace hapticd::rt
