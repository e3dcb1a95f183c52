#include "rt/control/force_controller.h"

#include <algorithm>
#include <cmath>

namespace hapticd::rt {

namespace {
double gain_per_sample(const ControllerParameters& p, double rate_hz) noexcept {
  return p.derivative_gain_ms * 1e-3 * rate_hz;
}
}  // namespace

bool gains_are_stable(const ControllerParameters& parameters, double rate_hz) noexcept {
  if (parameters.law == ControlLaw::kOpenLoop) return true;
  const double kp = parameters.proportional_gain;
  const double kd = gain_per_sample(parameters, rate_hz);
  return kp > 0.0 && std::abs(kd) < 1.0 && kp + 2.0 * kd < 2.0;
}

bool gains_settle(const ControllerParameters& parameters, double rate_hz) noexcept {
  if (parameters.law == ControlLaw::kOpenLoop) return true;
  if (!gains_are_stable(parameters, rate_hz)) return false;
  constexpr double kMaxRinging = 0.75;
  const double kd = gain_per_sample(parameters, rate_hz);
  const double sum = 1.0 - parameters.proportional_gain - kd;  // of the poles; their product is -kd
  const double discriminant = sum * sum + 4.0 * kd;
  if (discriminant < 0.0) return std::sqrt(-kd) <= kMaxRinging;
  const double root = std::sqrt(discriminant);
  const double slowest = 1.0 - 1.0 / (rate_hz * kMaxControllerTimeS);
  constexpr double kRounding = 1e-9;
  return 0.5 * (sum + root) <= std::max(slowest, 0.0) + kRounding && 0.5 * (sum - root) >= -kMaxRinging;
}

ForceController::ForceController(const ControllerParameters& parameters, double rate_hz) noexcept
    : law_(parameters.law),
      proportional_gain_(parameters.proportional_gain),
      derivative_gain_per_sample_(gain_per_sample(parameters, rate_hz)) {}

double ForceController::update(double desired_force_n) noexcept {
  if (law_ == ControlLaw::kOpenLoop) return desired_force_n;
  const double error = desired_force_n - device_force_n_;
  const double command =
      device_force_n_ + proportional_gain_ * error + derivative_gain_per_sample_ * (error - last_error_n_);
  last_error_n_ = error;
  return command;
}

void ForceController::reset() noexcept {
  device_force_n_ = 0.0;
  last_error_n_ = 0.0;
}

}  // namespace hapticd::rt
