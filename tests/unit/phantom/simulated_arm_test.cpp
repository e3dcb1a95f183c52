// The arm of the simulation, which shares no code with the driver's, against the driver's.

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>

#include "hal/geometry.h"
#include "hal/phantom/kinematics.h"
#include "hal/sim/device/arm.h"

namespace hapticd::test {
namespace {

using geometry::product;
using hal::Quaternion;
using hal::Vector3;

/// The driver's frame has x forward and y to the left, the simulation's y forward and x to the right.
Vector3 in_rig(const Vector3& of_driver) {
  return {-of_driver.y, of_driver.x, of_driver.z};
}
const Quaternion kQuarter{std::sqrt(0.5), 0.0, 0.0, std::sqrt(0.5)};

TEST(SimulatedArm, ItsAnglesGiveThePoseTheyAreOf) {
  const sim::Arm arm;
  const phantom::ArmGeometry geometry{.first_link_mm = arm.first_link_mm,
                                      .second_link_mm = arm.second_link_mm};
  const Vector3 home_mm = in_rig(phantom::forward_mm(geometry, {}));
  std::mt19937 random(7);
  std::uniform_real_distribution<double> place_mm(-70.0, 70.0);
  std::normal_distribution<double> part(0.0, 0.25);
  for (int i = 0; i < 1000; ++i) {
    const Vector3 tip_mm{place_mm(random), place_mm(random), place_mm(random)};
    const Quaternion tool = geometry::unit({1.0, part(random), part(random), part(random)});
    const hal::DeviceAngles angles = sim::angles_of(arm, tip_mm, tool);
    ASSERT_TRUE(angles.known);
    const Vector3 found_mm = in_rig(phantom::forward_mm(geometry, angles.joint_rad)) - home_mm;
    EXPECT_LT(geometry::norm(found_mm - tip_mm), 1e-9) << i;
    const Quaternion driver = phantom::orientation(angles.joint_rad, angles.gimbal_rad);
    const Quaternion found = product(kQuarter, product(driver, geometry::conjugate(kQuarter)));
    const double cosine = found.w * tool.w + found.x * tool.x + found.y * tool.y + found.z * tool.z;
    EXPECT_NEAR(std::abs(cosine), 1.0, 1e-12) << i;
  }
}

TEST(SimulatedArm, IsAtZeroAtTheOrigin) {
  const hal::DeviceAngles angles = sim::angles_of({}, {}, {});
  for (std::size_t i = 0; i < 3; ++i) {
    EXPECT_NEAR(angles.joint_rad[i], 0.0, 1e-12);
    EXPECT_NEAR(angles.gimbal_rad[i], 0.0, 1e-12);
  }
}

TEST(SimulatedArm, OutOfReachItIsStretched) {
  const hal::DeviceAngles angles = sim::angles_of({}, {0.0, 500.0, 170.0}, {});
  EXPECT_NEAR(angles.joint_rad[2] - angles.joint_rad[1], std::numbers::pi / 2.0, 1e-12);
}

}  // namespace
}  // namespace hapticd::test
