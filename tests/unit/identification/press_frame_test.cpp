#include "server/identification/estimate/contact/press_frame.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "contact_synthetic.h"
#include "rt/signal/vector.h"
#include "server/identification/session/contact/contact_identification.h"
#include "tests/support/turn.h"

namespace hapticd::identification {
namespace {

using hal::Quaternion;
using hal::Vector3;

constexpr double kPressToolG = 12.6;
constexpr double kWeightN = 1e-6 * kPressToolG * rt::ToolLoad::kGravityMmPerS2;
constexpr Vector3 kDown{0.0, 0.0, -1.0};
constexpr rt::HuntCrossleyParameters kFoldedLaw{0.25, 4e-4, 1.6};

hal::RigInfo press_rig() {
  hal::RigInfo info;
  info.kind = hal::RigKind::kHardware;
  info.rate_hz = 1000.0;
  info.device.position_resolution_mm = 0.007;
  info.sensor.range_n = 35.0;
  info.sensor.tool_mass_g = 0.0;
  return info;
}

/// What an awkward rig would measure of the same press: the object lies elsewhere, the tool is held askew,
/// the sensor is turned in it and was biased with the tool held in yet another way.
struct Awkward {
  Quaternion to_rig = hapticd::test::turn_about({0.3, 1.0, -0.2}, 70.0);  ///< press frame → rig frame
  Quaternion tool = hapticd::test::turn_about({1.0, -0.4, 0.8}, 35.0);    ///< orientation, rig frame
  Quaternion at_bias = hapticd::test::turn_about({0.1, 0.9, 0.3}, -50.0);
  Vector3 sensor_turn_deg{3.0, -2.0, 20.0};

  rt::Observation measured(const rt::Observation& upright) const {
    rt::Observation out = upright;
    const Vector3 load_n = rt::rotated(to_rig, upright.sample.sensor_force_n);
    const rt::SensorMounting mounting{sensor_turn_deg, {}};
    const Vector3 in_tool = rt::rotated(rt::conjugate(tool), load_n + kDown * kWeightN);
    const Vector3 taken_n = rt::rotated(rt::conjugate(at_bias), kDown * kWeightN);
    out.sample.tip_position_mm = rt::rotated(to_rig, upright.sample.tip_position_mm);
    out.sample.tip_orientation = tool;
    out.sample.sensor_force_n = rt::rotated(rt::conjugate(mounting.to_tool()), in_tool - taken_n);
    out.sample.bias_serial = 1;
    return out;
  }
  PressFrame frame() const {
    rt::SensorMounting mounting{sensor_turn_deg, {}};
    const Vector3 taken_n = rt::rotated(rt::conjugate(at_bias), kDown * kWeightN);
    mounting.force_bias_n = rt::rotated(rt::conjugate(mounting.to_tool()), taken_n) * -1.0;
    const PressGeometry geometry{rt::rotated(to_rig, kDown) * 3.0,
                                 rt::rotated(to_rig, {1.0, 0.0, 0.0}) * 0.2};
    return {geometry, rt::ToolLoad::mounted(kPressToolG, mounting), kPressToolG, press_rig()};
  }
};

double apart(const Vector3& a, const Vector3& b) {
  return rt::norm(a - b);
}

TEST(PressFrame, SetsAnAwkwardPressUpright) {
  const Awkward awkward;
  const PressFrame frame = awkward.frame();
  rt::Observation wanted;
  wanted.sample.tip_position_mm = {4.0, -2.0, -7.0};
  wanted.sample.sensor_force_n = {0.3, -0.2, 2.5};
  const rt::Observation seen = frame.upright(awkward.measured(wanted));
  EXPECT_LT(apart(seen.sample.tip_position_mm, wanted.sample.tip_position_mm), 1e-9);
  EXPECT_LT(apart(seen.sample.sensor_force_n, wanted.sample.sensor_force_n), 1e-9);
  EXPECT_EQ(seen.sample.tip_orientation.w, 1.0);
}

TEST(PressFrame, SeatsTheSensorAndLeavesTheToolAsItIsHeld) {
  const Awkward awkward;
  const rt::Observation free = awkward.measured(rt::Observation{});
  const rt::Observation seen = awkward.frame().seated(free);
  const rt::ToolLoad straight(kPressToolG, kDown);
  EXPECT_LT(rt::norm(straight.without_weight_n(seen.sample)), 1e-9);
  EXPECT_EQ(seen.sample.tip_orientation.x, awkward.tool.x);
}

TEST(PressFrame, ChangesNothingOfAnUprightPressAlongZ) {
  const PressFrame frame({}, rt::ToolLoad(kPressToolG, kDown), kPressToolG, press_rig());
  rt::Observation wanted;
  wanted.sample.tip_position_mm = {4.0, -2.0, -7.0};
  wanted.sample.sensor_force_n = {0.3, -0.2, 2.5};
  wanted.device_command_n = {0.0, 1.0, 2.0};
  const rt::Observation seen = frame.upright(wanted);
  EXPECT_LT(apart(seen.sample.tip_position_mm, wanted.sample.tip_position_mm), 1e-12);
  EXPECT_LT(apart(seen.sample.sensor_force_n, wanted.sample.sensor_force_n), 1e-12);
  EXPECT_LT(apart(seen.device_command_n, wanted.device_command_n), 1e-12);
}

TEST(PressFrame, PressesUpAndSidewaysAreTurnedAsWell) {
  for (const Vector3& press : {Vector3{0.0, 0.0, 1.0}, Vector3{0.0, 0.0, -1.0}, Vector3{1.0, 0.0, 0.0},
                               Vector3{0.0, -1.0, 0.0}, Vector3{1.0, 1.0, 1.0}}) {
    const Vector3 line = rt::cross(press, {0.2, 0.5, -0.7});
    const PressFrame frame({press, line}, rt::ToolLoad(0.0, kDown), 0.0, press_rig());
    rt::Observation at;
    at.sample.tip_position_mm = rt::direction_or(press, kDown) * 5.0;
    EXPECT_LT(apart(frame.upright(at).sample.tip_position_mm, kDown * 5.0), 1e-9);
    at.sample.tip_position_mm = rt::direction_or(line, kDown) * 5.0;
    EXPECT_LT(apart(frame.upright(at).sample.tip_position_mm, {5.0, 0.0, 0.0}), 1e-9);
  }
}

TEST(PressFrame, DirectionsThatTellNothingAreNotUsable) {
  EXPECT_TRUE(is_usable({}));
  EXPECT_TRUE(is_usable({{0.0, 5.0, 0.0}, {1.0, 5.0, 0.0}}));
  EXPECT_FALSE(is_usable({{0.0, 0.0, 0.0}, {1.0, 0.0, 0.0}}));
  EXPECT_FALSE(is_usable({kDown, {0.0, 0.0, 0.0}}));
  EXPECT_FALSE(is_usable({kDown, {0.0, 0.1, 3.0}}));
  EXPECT_FALSE(is_usable({{std::numeric_limits<double>::quiet_NaN(), 0.0, 1.0}, {1.0, 0.0, 0.0}}));
  EXPECT_FALSE(is_usable({{std::numeric_limits<double>::infinity(), 0.0, 1.0}, {1.0, 0.0, 0.0}}));
}

TEST(PressFrame, FollowsADriftOfTheZeroWhileFreeAndNotWhilePressed) {
  PressFrame frame({}, rt::ToolLoad(0.0, kDown), 0.0, press_rig());
  const auto look = [&frame](int from, int to, double load_n) {
    rt::Observation seen;
    for (int tick = from; tick < to; ++tick) {
      rt::Observation now;
      now.sample.time_ns = std::int64_t{1'000'000} * tick;
      now.sample.bias_serial = 1;
      now.sample.force_count = 7;
      now.sample.sensor_force_n = {0.0, 0.0, 1e-6 * tick + load_n};  // 1 mN/s
      now.sample.tip_position_mm = {0.0, 0.0, -load_n};
      frame.follow_zero(now.sample);
      seen = frame.upright(now);
    }
    return seen.sample.sensor_force_n.z;
  };
  EXPECT_NEAR(look(0, 60'000, 0.0), 0.0, 0.005) << "60 mN have drifted in";
  const double zero_n = frame.zero().force_n.z;
  EXPECT_NEAR(look(60'000, 65'000, 2.0), 2.0, 0.01);
  EXPECT_NEAR(frame.zero().force_n.z, zero_n, 2e-4) << "a load is no zero";
}

TEST(PressFrame, WhatDriftedInDuringALongPressIsFollowedOnceTheTipHasDrawnBack) {
  // 30 mN within one press: more than the threshold, so that the free tool reads like a contact.
  PressFrame frame({}, rt::ToolLoad(0.0, kDown), 0.0, press_rig());
  rt::Observation seen;
  const auto look = [&](int ticks, double load_n, double height_mm) {
    static int tick = 0;
    for (int end = tick + ticks; tick < end; ++tick) {
      rt::Observation now;
      now.sample.time_ns = std::int64_t{1'000'000} * tick;
      now.sample.bias_serial = 1;
      now.sample.force_count = 7;
      now.sample.sensor_force_n = {0.0, 0.0, (tick > 2'000 ? 1.5e-6 * (tick - 2'000) : 0.0) + load_n};
      now.sample.tip_position_mm = {0.0, 0.0, height_mm};
      frame.follow_zero(now.sample);
      seen = frame.upright(now);
    }
    return seen.sample.sensor_force_n.z;
  };
  look(2'000, 0.0, 9.0);
  for (int i = 0; i <= 90; ++i) look(2, 0.0, 9.0 - 0.1 * i);
  look(20'000, 2.0, -4.0);
  for (int i = 0; i <= 90; ++i) look(2, 0.0, 0.1 * i);
  EXPECT_GT(look(1, 0.0, 9.0), 0.015);
  EXPECT_NEAR(look(4'000, 0.0, 9.0), 0.0, 0.005);
}

TEST(PressFrame, UnfitSamplesLeaveTheZeroAlone) {
  PressFrame frame({}, rt::ToolLoad(0.0, kDown), 0.0, press_rig());
  for (int tick = 0; tick < 5000; ++tick) {
    hal::RigSample sample;
    sample.time_ns = std::int64_t{1'000'000} * tick;
    sample.bias_serial = 1;
    sample.force_count = 1;
    sample.sensor_force_n = {0.0, 0.0, 0.01};
    if (tick % 2 == 0) sample.status = hal::sample_status::kForceMissing;
    if (tick % 3 == 0) sample.sensor_force_n.x = std::numeric_limits<double>::quiet_NaN();
    frame.follow_zero(sample);
  }
  EXPECT_TRUE(std::isfinite(rt::norm(frame.zero().force_n)));
  EXPECT_LE(rt::norm(frame.zero().force_n), 0.0101);
}

TEST(PressFrame, AContactIsIdentifiedTheSameWhereverItIs) {
  const Awkward awkward;
  const auto observations = test::synthetic_observations(kFoldedLaw, 7.0);
  const auto identified = [&](bool is_awkward) {
    ContactIdentification identification({.law = rt::ContactLawKind::kHuntCrossley}, press_rig());
    PressFrame frame = awkward.frame();
    for (const rt::Observation& observation : observations) {
      if (!is_awkward) {
        identification.add(observation);
        continue;
      }
      const rt::Observation seen = awkward.measured(observation);
      frame.follow_zero(seen.sample);
      identification.add(frame.upright(seen));
    }
    const auto model = identification.finish();
    if (!model) {
      ADD_FAILURE() << model.error().text();
      return rt::HuntCrossleyParameters{};
    }
    return std::get<rt::ContactModel>(model->content).hunt_crossley->parameters;
  };
  const rt::HuntCrossleyParameters plain = identified(false);
  const rt::HuntCrossleyParameters turned = identified(true);
  EXPECT_NEAR(turned.stiffness_n_per_mm_m / plain.stiffness_n_per_mm_m, 1.0, 0.02);
  EXPECT_NEAR(turned.exponent, plain.exponent, 0.02);
}

}  // namespace
}  // namespace hapticd::identification
