#pragma once

#include "hal/samples.h"

namespace hapticd::rt {

/// The line a one-dimensional scene lives on: a unit vector into the object.
class PressAxis {
 public:
  explicit PressAxis(const hal::Vector3& unit) noexcept : unit_(unit) {}

  /// Coordinate of a point, mm, growing into the object.
  double depth_mm(const hal::Vector3& position_mm) const noexcept { return dot(unit_, position_mm); }
  /// Force *on* the tool as the one-dimensional equations count it: positive when it pushes the tool back.
  double reaction_n(const hal::Vector3& force_on_tool_n) const noexcept {
    return -dot(unit_, force_on_tool_n);
  }
  /// Device force in the rig frame, from the one that the one-dimensional equations count (positive into the
  /// object), and back.
  hal::Vector3 device_force_n(double along_axis_n) const noexcept { return unit_ * along_axis_n; }
  double along_axis_n(const hal::Vector3& device_force_n) const noexcept {
    return dot(unit_, device_force_n);
  }

 private:
  hal::Vector3 unit_;
};

}  // namespace hapticd::rt
