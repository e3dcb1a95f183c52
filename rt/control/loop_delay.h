#pragma once

#include <algorithm>

#include "rt/control/force_controller.h"

namespace hapticd::rt {

/// Delay from the command to the motors: latency of the device's interface, 1 ms, and the amplifier's pole,
/// 0.5 ms at 300 Hz. Approximate: no device reports it.
inline constexpr double kActuationDelayS = 1.5e-3;

/// Delay with which the motors give what (3.3) makes of a slowly changing reaction, s: the controller's lag T
/// (1/Kp - 1) (without Kd (3.6) is a first-order lag), half a period for which a command is held, half a
/// period of the sensor's mean, and the actuation. 3.7 ms on a PHANToM 1.0 at 1 kHz, 2.5 ms with the
/// high-force device's gains.
constexpr double reaction_delay_s(const ControllerParameters& controller, double rate_hz) noexcept {
  const bool lags = controller.law == ControlLaw::kClosedLoop && controller.proportional_gain > 0.0;
  const double periods = (lags ? 1.0 / controller.proportional_gain - 1.0 : 0.0) + 1.0;
  return std::max(0.0, periods / rate_hz + kActuationDelayS);
}

}  // namespace hapticd::rt
