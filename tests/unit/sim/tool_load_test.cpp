// What the sensor carries next to the contact: inertia and weight of the tool.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>

#include "tests/support/turn.h"
#include "virtual_rig.h"

namespace hapticd::sim {
namespace {

using hal::Vector3;
using test::turned;
using test::VirtualRig;

constexpr double kGravityNPerKg = 9.807;

TEST(ToolLoad, AnAcceleratedToolReadsMinusMassTimesAcceleration) {
  for (const double mass_g : {9.35, 100.0}) {
    VirtualRig rig({.object = "none", .rate_hz = 10000.0, .tool_mass_g = mass_g},
                   {.kind = HandProgram::Kind::kShake, .force_n = 2.0, .rate_hz = 8.0});
    double before_mm = 0.0, here_mm = 0.0, reading_n = 0.0;
    double product = 0.0, square = 0.0;
    int ticks = 0;
    rig.run(3.0, [&] {
      const double after_mm = rig.truth().tip_position_mm.z;
      if (ticks++ > 10) {
        const double acceleration_m_per_s2 = 1e-3 * (after_mm - 2.0 * here_mm + before_mm) / 1e-8;
        product += reading_n * acceleration_m_per_s2;
        square += acceleration_m_per_s2 * acceleration_m_per_s2;
      }
      before_mm = here_mm;
      here_mm = after_mm;
      reading_n = rig.sample().sensor_force_n.z;
    });
    ASSERT_GT(std::sqrt(square / ticks), 1.0) << "shaken hard enough to report";
    EXPECT_NEAR(1e3 * product / square, -mass_g, 0.02 * mass_g);
  }
}

class TiltedTool : public testing::TestWithParam<double> {};
INSTANTIATE_TEST_SUITE_P(Tilts, TiltedTool, testing::Values(20.0, 60.0), [](const auto& tested) {
  return std::to_string(std::lround(tested.param)) + "_deg";
});

TEST_P(TiltedTool, ItsWeightIsReportedFromContactByTheGimbal) {
  for (const double mass_g : {9.35, 50.0}) {
    VirtualRig rig({.object = "none", .tool_mass_g = mass_g}, {.tilt_deg = GetParam()});
    const Vector3 weight_n{0.0, 0.0, -1e-3 * mass_g * kGravityNPerKg};
    // What a tick's mean leaves: noise of the sensor, inertia in the hand's tremor (up to 0.2 m/s²), and half
    // a millisecond in which the tool turned on while the sensor took its mean.
    const double per_axis_n = 0.012 + 1e-3 * mass_g * (0.25 + kGravityNPerKg * 0.003);
    Vector3 sum_n;
    double max_n = 0.0;
    int ticks = 0;
    rig.run(2.0);  // at its home
    rig.run(20.0, [&] {
      const Vector3& read_n = rig.sample().sensor_force_n;
      // Taken upright, the bias was the weight as it is in rig coordinates.
      const Vector3 contact_n = turned(rig.sample().tip_orientation, read_n + weight_n) - weight_n;
      ASSERT_LT(std::abs(contact_n.x), per_axis_n) << rig.time_s();
      ASSERT_LT(std::abs(contact_n.y), per_axis_n) << rig.time_s();
      ASSERT_LT(std::abs(contact_n.z), per_axis_n) << rig.time_s();
      sum_n = sum_n + contact_n;
      max_n = std::max(max_n, test::length(read_n));
      ++ticks;
    });
    EXPECT_LT(test::length(sum_n * (1.0 / ticks)), 1e-3);
    const double tilt_rad = GetParam() * 3.14159265 / 180.0;
    EXPECT_GT(max_n, 2.0 * std::sin(0.5 * tilt_rad) * -weight_n.z) << "the raw reading does carry it";
  }
}

TEST_P(TiltedTool, SwaysFromUprightAsFarAsAskedAndWithoutAJump) {
  VirtualRig rig({.object = "none"}, {.tilt_deg = GetParam()});
  double max_x_rad = 0.0, max_y_rad = 0.0;
  Vector3 up_before;
  const auto up = [&] { return turned(rig.sample().tip_orientation, {0.0, 0.0, 1.0}); };
  rig.tick();
  EXPECT_NEAR(up().z, 1.0, 1e-4) << "upright at first";
  up_before = up();
  const auto observe = [&] {
    const hal::Quaternion& q = rig.sample().tip_orientation;
    ASSERT_NEAR(q.w * q.w + q.x * q.x + q.y * q.y + q.z * q.z, 1.0, 1e-12);
    // A rotation's vector; about z only what wobble and noise make of it.
    const double angle = 2.0 * std::acos(std::min(1.0, q.w));
    const double scale = angle > 1e-9 ? angle / std::sin(0.5 * angle) : 2.0;
    max_x_rad = std::max(max_x_rad, std::abs(scale * q.x));
    max_y_rad = std::max(max_y_rad, std::abs(scale * q.y));
    ASSERT_LT(std::abs(scale * q.z), 0.01);
    ASSERT_LT(test::length(up() - up_before), 8e-3) << "no faster than a wrist turns";
    up_before = up();
  };
  rig.run(30.0, observe);
  const double tilt_rad = GetParam() * 3.14159265 / 180.0;
  EXPECT_NEAR(max_x_rad, tilt_rad, 0.01);
  EXPECT_NEAR(max_y_rad, tilt_rad, 0.01);
  // Another program takes over from where the tool is, and brings it upright.
  rig.set_program({});
  rig.run(1.5, observe);
  EXPECT_NEAR(up().z, 1.0, 1e-4);
}

TEST(TiltedToolInContact, IsReadInTheToolsFrameAndTheTipIsWhereAnUprightOnesIs) {
  const HandProgram upright{
      .kind = HandProgram::Kind::kPress, .force_n = 3.0, .force_rate_n_per_s = 4.0, .hold_s = -1.0};
  HandProgram tilted = upright;
  tilted.tilt_deg = 40.0;
  VirtualRig one({.tool_mass_g = 0.0}, upright), other({.tool_mass_g = 0.0}, tilted);
  one.run(6.0);
  other.run(6.0);
  double max_across_n = 0.0;
  for (int i = 0; i < 5000; ++i) {
    one.tick();
    other.tick();
    ASSERT_EQ(one.truth().tip_position_mm.z, other.truth().tip_position_mm.z);
    const Vector3 read_n = turned(other.sample().tip_orientation, other.sample().sensor_force_n);
    ASSERT_LT(test::length(read_n - other.truth().reaction_force_n), 0.025);
    max_across_n = std::max(max_across_n, std::abs(other.sample().sensor_force_n.x));
  }
  EXPECT_GT(max_across_n, 1.0);
}

TEST(ToolLoad, OrientationReadingIsAUnitQuaternionWithTheGimbalsNoise) {
  VirtualRig rig({.object = "none"});
  // Second differences at 1 kHz leave the noise of the reading: variance 6 times that of one.
  double before = 0.0, here = 0.0, square = 0.0;
  int ticks = 0;
  rig.run(10.0, [&] {
    const hal::Quaternion& q = rig.sample().tip_orientation;
    ASSERT_NEAR(q.w * q.w + q.x * q.x + q.y * q.y + q.z * q.z, 1.0, 1e-12);
    const double after = 2.0 * q.x;
    if (ticks++ > 2) square += (after - 2.0 * here + before) * (after - 2.0 * here + before);
    before = here;
    here = after;
  });
  EXPECT_NEAR(std::sqrt(square / ticks / 6.0), device_preset("phantom_1_0")->gimbal_noise_rad, 0.05 * 2e-4);
}

}  // namespace
}  // namespace hapticd::sim
