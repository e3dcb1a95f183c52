#pragma once

#include "rt/friction/dahl.h"
#include "rt/signal/vector.h"

namespace hapticd::rt {

/// Takes off the hand most of what it costs to drive the device's own motors and cables: their dry friction
/// is between the command and the tip, 0.06 N on a small device, 0.2 N on a large one, and its sign is
/// that of the last motion. Dahl's state follows that motion, so the compensation holds while the hand holds
/// still and turns over a tenth of a millimetre when it turns back. It gives less than the friction it
/// compensates, so device and compensation together stay dissipative.
/// `Value` is a number along a line or a vector in the rig frame.
template <class Value>
class BasicBackDriveCompensation {
 public:
  static constexpr double kShare = 0.8;
  static constexpr double kTurnOverMm = 0.1;

  /// Makes a compensation; it gives zero if the device's friction is unknown.
  explicit BasicBackDriveCompensation(double friction_n) noexcept
      : device_friction_n_(friction_n), force_n_(kShare * friction_n) {}

  /// Takes the motion of the encoders since the last tick; returns the force to add to the command.
  Value update(const Value& step_mm) noexcept {
    direction_ = dahl_step(direction_, step_mm, kTurnOverMm);
    return direction_ * force_n_;
  }
  /// Friction against the motion, N, positive where the device moves forward.
  Value friction_n() const noexcept { return direction_ * device_friction_n_; }
  void reset() noexcept { direction_ = Value{}; }
  bool is_on() const noexcept { return force_n_ > 0.0; }

 private:
  double device_friction_n_;
  double force_n_;
  Value direction_{};
};

using BackDriveCompensation = BasicBackDriveCompensation<double>;
using BackDriveCompensation3 = BasicBackDriveCompensation<hal::Vector3>;

}  // namespace hapticd::rt
