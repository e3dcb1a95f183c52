#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>

#include "hal/geometry.h"
#include "hal/openhaptics/device_frame.h"
#include "hd_bench.h"
#include "tests/support/turn.h"

namespace hapticd::test {
namespace {

using geometry::rotated;
using hal::Quaternion;
using hal::Vector3;
using openhaptics::device_from_rig;
using openhaptics::orientation_in_rig;
using openhaptics::rig_from_device;
using openhaptics::Transform;

Transform with_axes(const Vector3& x, const Vector3& y, const Vector3& z) {
  return {x.x, x.y, x.z, 0.0, y.x, y.y, y.z, 0.0, z.x, z.y, z.z, 0.0, 0.0, 0.0, 0.0, 1.0};
}

void expect_near(const Vector3& a, const Vector3& b, double tolerance) {
  EXPECT_NEAR(a.x, b.x, tolerance);
  EXPECT_NEAR(a.y, b.y, tolerance);
  EXPECT_NEAR(a.z, b.z, tolerance);
}

TEST(OpenHapticsFrame, UpIsUpRightIsRightAndTowardsTheUserIsMinusY) {
  expect_near(rig_from_device({1.0, 0.0, 0.0}), {1.0, 0.0, 0.0}, 0.0);
  expect_near(rig_from_device({0.0, 1.0, 0.0}), {0.0, 0.0, 1.0}, 0.0);
  expect_near(rig_from_device({0.0, 0.0, 1.0}), {0.0, -1.0, 0.0}, 0.0);
}

TEST(OpenHapticsFrame, IsARotationSoPowerStaysWhatItIs) {
  std::mt19937 random(1);
  std::uniform_real_distribution<double> number(-5.0, 5.0);
  for (int i = 0; i < 100; ++i) {
    const Vector3 force{number(random), number(random), number(random)};
    const Vector3 velocity{number(random), number(random), number(random)};
    EXPECT_NEAR(dot(force, velocity), dot(rig_from_device(force), rig_from_device(velocity)), 1e-12);
    expect_near(device_from_rig(rig_from_device(force)), force, 0.0);
  }
  // Right-handed in, right-handed out: x × y = z.
  const Vector3 x = rig_from_device({1.0, 0.0, 0.0});
  const Vector3 y = rig_from_device({0.0, 1.0, 0.0});
  expect_near({x.y * y.z - x.z * y.y, x.z * y.x - x.x * y.z, x.x * y.y - x.y * y.x},
              rig_from_device({0.0, 0.0, 1.0}), 0.0);
}

TEST(OpenHapticsFrame, AnUprightStylusIsAnUprightTool) {
  // Its end points up: the stylus's z is the device's y.
  const auto upright = orientation_in_rig(with_axes({1.0, 0.0, 0.0}, {0.0, 0.0, -1.0}, {0.0, 1.0, 0.0}));
  ASSERT_TRUE(upright);
  EXPECT_NEAR(std::abs(upright->w), 1.0, 1e-12);
  // At the vendor's zero it points to the user.
  const auto level = orientation_in_rig(with_axes({1.0, 0.0, 0.0}, {0.0, 1.0, 0.0}, {0.0, 0.0, 1.0}));
  ASSERT_TRUE(level);
  expect_near(rotated(*level, {0.0, 0.0, 1.0}), {0.0, -1.0, 0.0}, 1e-12);
}

TEST(OpenHapticsFrame, AnyRotationTurnsAllAxesAsTheTransformDoes) {
  std::mt19937 random(2);
  std::normal_distribution<double> number;
  std::uniform_real_distribution<double> angles_deg(-180.0, 180.0);
  for (int i = 0; i < 1000; ++i) {
    // Half-turns too, where a careless formula divides by zero.
    const Quaternion turn = turn_about({number(random), number(random), number(random)},
                                       i % 10 == 0 ? 180.0 : angles_deg(random));
    Vector3 axes[3] = {{1.0, 0.0, 0.0}, {0.0, 1.0, 0.0}, {0.0, 0.0, 1.0}};
    for (Vector3& a : axes) a = turned(turn, a);
    const auto q = orientation_in_rig(with_axes(axes[0], axes[1], axes[2]));
    ASSERT_TRUE(q);
    EXPECT_NEAR(q->w * q->w + q->x * q->x + q->y * q->y + q->z * q->z, 1.0, 1e-12);
    expect_near(rotated(*q, {1.0, 0.0, 0.0}), rig_from_device(axes[0]), 1e-9);
    expect_near(rotated(*q, {0.0, 1.0, 0.0}), rig_from_device(axes[1]), 1e-9);
    expect_near(rotated(*q, {0.0, 0.0, 1.0}), rig_from_device(axes[2]), 1e-9);
  }
}

TEST(OpenHapticsFrame, ScaledAndSkewedAxesAreStraightened) {
  const auto q = orientation_in_rig(with_axes({1.02, 0.01, 0.0}, {0.03, 0.97, 0.01}, {0.0, 0.0, 1.1}));
  ASSERT_TRUE(q);
  expect_near(rotated(*q, {0.0, 0.0, 1.0}), {0.0, -1.0, 0.0}, 1e-12);  // the stylus is not touched
  expect_near(rotated(*q, {1.0, 0.0, 0.0}), {1.0, 0.0, 0.0}, 0.02);
}

TEST(OpenHapticsFrame, WhatIsNoRotationIsRefused) {
  const Vector3 x{1.0, 0.0, 0.0}, y{0.0, 1.0, 0.0}, z{0.0, 0.0, 1.0};
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const double infinity = std::numeric_limits<double>::infinity();
  EXPECT_FALSE(orientation_in_rig({}));
  EXPECT_FALSE(orientation_in_rig(with_axes(x, y, {0.0, 0.0, -1.0})));  // mirrored
  EXPECT_FALSE(orientation_in_rig(with_axes(x, x, z)));
  EXPECT_FALSE(orientation_in_rig(with_axes(x, {0.7, 0.7, 0.0}, z)));
  EXPECT_FALSE(orientation_in_rig(with_axes(x, y, z * 3.0)));
  EXPECT_FALSE(orientation_in_rig(with_axes(x, {0.0, nan, 0.0}, z)));
  EXPECT_FALSE(orientation_in_rig(with_axes({infinity, 0.0, 0.0}, y, z)));
}

TEST(OpenHapticsFrame, PositionAndForceGoThroughTheDeviceInOneFrame) {
  HdBench bench([](OpenHapticsConfig& config) { config.origin_mm = {10.0, 20.0, 30.0}; });
  bench.page.set_pose({11.0, 22.0, 33.0}, {});
  bench.body->ask({0.1, -0.3, 0.2});
  ASSERT_TRUE(bench.runs(3));
  expect_near(bench.body->sample().tip_position_mm, {1.0, -3.0, 2.0}, 1e-12);
  EXPECT_EQ(bench.body->sample().status, 0U);
  ASSERT_TRUE(bench.feels(0.2));
  expect_near(bench.page.force_n(), {0.1, 0.2, 0.3}, 1e-12);
}

TEST(OpenHapticsFrame, ThePositionsAgeCountsFromTheFrameInWhichItWasRead) {
  HdBench bench([](OpenHapticsConfig&) {});
  bench.page.set_pose({11.0, 22.0, 33.0}, {});
  ASSERT_TRUE(bench.runs(3));
  const std::int64_t age_ns = bench.body->sample().position_age_ns;
  EXPECT_GE(age_ns, 0);
  EXPECT_LT(age_ns, 100'000'000);
  bench.page.device().position_is_nan = true;  // the last one stays, and grows old
  ASSERT_TRUE(bench.ticks(30));
  EXPECT_GT(bench.body->sample().position_age_ns, 10'000'000);
}

TEST(OpenHapticsFrame, TheTipHangsOnTheStylusAsItIsMounted) {
  HdBench bench([](OpenHapticsConfig& config) {
    config.tip_offset_mm = {0.0, 0.0, -60.0};
    config.tool_to_stylus = {std::sqrt(0.5), 0.0, 0.0, std::sqrt(0.5)};  // a quarter turn about the stylus
  });
  bench.page.set_pose({0.0, 100.0, 0.0}, {std::sqrt(0.5), -std::sqrt(0.5), 0.0, 0.0});  // end up
  ASSERT_TRUE(bench.runs(3));
  expect_near(bench.body->sample().tip_position_mm, {0.0, 0.0, 40.0}, 1e-9);
  expect_near(rotated(bench.body->sample().tip_orientation, {1.0, 0.0, 0.0}), {0.0, 1.0, 0.0}, 1e-9);
}

TEST(OpenHapticsFrame, APoseThatIsNoneIsAFaultAndTheLastOneStays) {
  HdBench bench;
  bench.page.set_pose({1.0, 2.0, 3.0}, {});
  ASSERT_TRUE(bench.renders(1.0));
  for (auto* broken : {&bench.page.device().position_is_nan, &bench.page.device().transform_is_nan}) {
    *broken = true;
    bench.page.set_pose({5.0, 5.0, 5.0}, {});
    EXPECT_TRUE(bench.sees(status::kDeviceFault));
    EXPECT_TRUE(bench.feels(0.0));
    expect_near(bench.body->sample().tip_position_mm, {1.0, -3.0, 2.0}, 1e-12);
    bench.page.set_pose({1.0, 2.0, 3.0}, {});
    *broken = false;
    EXPECT_TRUE(bench.sees_no(status::kDeviceFault));
    EXPECT_TRUE(bench.feels(1.0));
  }
  EXPECT_GE(bench.figure("positions_rejected"), 2.0);
  bench.page.set_pose({1e6, 0.0, 0.0}, {});  // finite, but nowhere
  EXPECT_TRUE(bench.sees(status::kDeviceFault));
  expect_near(bench.body->sample().tip_position_mm, {1.0, -3.0, 2.0}, 1e-12);
}

TEST(OpenHapticsFrame, AMirroredTransformKeepsTheLastOrientationAndIsCounted) {
  HdBench bench;
  bench.page.set_pose({}, {std::sqrt(0.5), -std::sqrt(0.5), 0.0, 0.0});
  ASSERT_TRUE(bench.runs(3));
  bench.page.device().transform_is_mirrored = true;
  ASSERT_TRUE(eventually([&] { return bench.figure("orientations_rejected") > 2.0; }));
  expect_near(rotated(bench.body->sample().tip_orientation, {0.0, 0.0, 1.0}), {0.0, 0.0, 1.0}, 1e-9);
}

}  // namespace
}  // namespace hapticd::test
