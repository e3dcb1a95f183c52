#pragma once

#include <array>

#include "hal/samples.h"
#include "rt/control/force_controller.h"

namespace hapticd::rt {

/// (4.24): the controller of (3.6) on each axis of the rig.
class ThreeAxisController {
 public:
  ThreeAxisController(const ControllerParameters& parameters, double rate_hz) noexcept
      : axes_{ForceController(parameters, rate_hz), ForceController(parameters, rate_hz),
              ForceController(parameters, rate_hz)} {}

  hal::Vector3 update(const hal::Vector3& desired_n) noexcept {
    return {axes_[0].update(desired_n.x), axes_[1].update(desired_n.y), axes_[2].update(desired_n.z)};
  }
  void applied(const hal::Vector3& force_n) noexcept {
    axes_[0].applied(force_n.x);
    axes_[1].applied(force_n.y);
    axes_[2].applied(force_n.z);
  }
  void reset() noexcept {
    for (ForceController& axis : axes_) axis.reset();
  }
  /// The observer's f_d: what the device was given last.
  hal::Vector3 device_force_n() const noexcept {
    return {axes_[0].device_force_n(), axes_[1].device_force_n(), axes_[2].device_force_n()};
  }

 private:
  std::array<ForceController, 3> axes_;
};

}  // namespace hapticd::rt
