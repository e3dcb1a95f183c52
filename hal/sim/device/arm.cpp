#include "hal/sim/device/arm.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "hal/sim/base/rotation.h"

namespace hapticd::sim {

hal::DeviceAngles angles_of(const Arm& arm, const hal::Vector3& tip_mm,
                            const hal::Quaternion& orientation) noexcept {
  const double l1 = arm.first_link_mm;
  const double l2 = arm.second_link_mm;
  const double forward_mm = tip_mm.y + l1;
  const double left_mm = -tip_mm.x;
  const double up_mm = tip_mm.z - l2;
  const double reach_mm = std::hypot(forward_mm, left_mm);

  const double base_rad = std::atan2(left_mm, forward_mm);
  // Triangle of both links: the angle of the second from the perpendicular of the first.
  const double sine = (reach_mm * reach_mm + up_mm * up_mm - l1 * l1 - l2 * l2) / (2.0 * l1 * l2);
  const double elbow_rad = std::asin(std::clamp(sine, -1.0, 1.0));
  const double first_rad =
      std::atan2(up_mm, reach_mm) - std::atan2(-l2 * std::cos(elbow_rad), l1 + l2 * std::sin(elbow_rad));
  const double second_rad = first_rad + elbow_rad;

  // The arm's frame has x forward: the rig's, turned by a quarter about z.
  constexpr double kQuarter = 0.5 * std::numbers::pi;
  const hal::Quaternion in_arm =
      composed(rotation({0.0, 0.0, -kQuarter}), composed(orientation, rotation({0.0, 0.0, kQuarter})));
  const hal::Quaternion second_link =
      composed(rotation({0.0, 0.0, base_rad}), rotation({0.0, -second_rad, 0.0}));
  const hal::Quaternion g = composed(inverse(second_link), in_arm);
  const double across = std::clamp(2.0 * (g.w * g.y - g.z * g.x), -1.0, 1.0);
  return {{base_rad, first_rad, second_rad},
          {std::atan2(2.0 * (g.x * g.y + g.w * g.z), 1.0 - 2.0 * (g.y * g.y + g.z * g.z)), std::asin(across),
           std::atan2(2.0 * (g.y * g.z + g.w * g.x), 1.0 - 2.0 * (g.x * g.x + g.y * g.y))},
          true};
}

}  // namespace hapticd::sim
