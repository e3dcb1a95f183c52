#include "rt/control/force_controller.h"

#include <algorithm>
#include <cmath>

namespace hapticd::rt {

bool gains_are_stable(const ControllerParameters& parameters, double rate_hz) noexcept {
  if (parameters.law == ControlLaw::kOpenLoop) return true;
  const double kp = parameters.proportional_gain;
  const double kd = derivative_gain_per_sample(parameters, rate_hz);
  return kp > 0.0 && std::abs(kd) < 1.0 && kp + 2.0 * kd < 2.0;
}

bool gains_settle(const ControllerParameters& parameters, double rate_hz) noexcept {
  if (parameters.law == ControlLaw::kOpenLoop) return true;
  if (!gains_are_stable(parameters, rate_hz)) return false;
  constexpr double kMaxRinging = 0.75;
  const double kd = derivative_gain_per_sample(parameters, rate_hz);
  const double sum = 1.0 - parameters.proportional_gain - kd;  // of the poles; their product is -kd
  const double discriminant = sum * sum + 4.0 * kd;
  if (discriminant < 0.0) return std::sqrt(-kd) <= kMaxRinging;
  const double root = std::sqrt(discriminant);
  const double slowest = 1.0 - 1.0 / (rate_hz * kMaxControllerTimeS);
  constexpr double kRounding = 1e-9;
  return 0.5 * (sum + root) <= std::max(slowest, 0.0) + kRounding && 0.5 * (sum - root) >= -kMaxRinging;
}

}  // namespace hapticd::rt
