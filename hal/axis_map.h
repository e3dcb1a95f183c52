#pragma once

#include <array>
#include <string>
#include <string_view>

#include "hal/error.h"
#include "hal/samples.h"

namespace hapticd::hal {

/// How a sensor is mounted on the tool, in quarter turns: for each axis of the tool, the sensor axis and
/// its sign. Written as three signed letters for the tool's x, y and z: "+y -x +z" means that the tool's x
/// is the sensor's y and the tool's y is the sensor's -x. Always right-handed: a mirrored mounting does not
/// exist, so a left-handed text is refused as a mistake.
class AxisMap {
 public:
  /// Maps the sensor's axes to the same axes of the tool.
  AxisMap() = default;
  /// Error: the text does not name three different axes, or is left-handed. `where` is the place for the
  /// error.
  static Result<AxisMap> parse(std::string_view text, std::string_view where);

  /// Turns a force or torque from the sensor's axes into the tool's; no mirror is involved.
  constexpr Vector3 to_tool(const Vector3& sensor) const noexcept {
    const std::array<double, 3> v{sensor.x, sensor.y, sensor.z};
    return {sign_[0] * v[axis_[0]], sign_[1] * v[axis_[1]], sign_[2] * v[axis_[2]]};
  }
  /// "+x +y +z".
  std::string text() const;

 private:
  std::array<std::size_t, 3> axis_{0, 1, 2};  ///< of the sensor, for each of the tool
  std::array<double, 3> sign_{1.0, 1.0, 1.0};
};

}  // namespace hapticd::hal
