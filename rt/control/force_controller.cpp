#include "rt/control/force_controller.h"

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
