#include "hal/sim/sensor/sensor_zero.h"

#include <cmath>

namespace hapticd::sim {

namespace {
// A random walk has no rate. It is given the spread that makes it move, over ten seconds, as far as the ramp
// would: sigma sqrt(10 s) = rate · 10 s.
constexpr double kWalkOverS = 10.0;
}  // namespace

SensorZero::SensorZero(const Conditions& conditions, std::uint64_t seed, double step_s) noexcept
    : conditions_(conditions),
      random_(seed ^ 0x7a65726fULL),
      step_s_(step_s),
      active_(conditions.sensor_drift_n_per_s > 0.0 || conditions.sensor_step_n > 0.0 ||
              conditions.sensor_crosstalk_share > 0.0 || conditions.bias_error_x_n != 0.0 ||
              conditions.bias_error_y_n != 0.0 || conditions.bias_error_z_n != 0.0),
      until_jump_s_(conditions.sensor_step_interval_s) {
  const auto sign = [this] { return random_.uniform() < 0.5 ? -1.0 : 1.0; };
  for (std::size_t row = 0; row < 3; ++row) {
    for (std::size_t column = 0; column < 3; ++column) {
      mixing_[3 * row + column] = row == column ? 1.0 : sign() * conditions.sensor_crosstalk_share;
    }
    drift_sign_[row] = sign();
  }
  offset_n_ = {-conditions.bias_error_x_n, -conditions.bias_error_y_n, -conditions.bias_error_z_n};
}

hal::Vector3 SensorZero::crossed(const hal::Vector3& f) const noexcept {
  const auto row = [&](std::size_t i) {
    return mixing_[i] * f.x + mixing_[i + 1] * f.y + mixing_[i + 2] * f.z;
  };
  return {row(0), row(3), row(6)};
}

void SensorZero::advance() noexcept {
  const double rate = conditions_.sensor_drift_n_per_s;
  const double bound = conditions_.sensor_drift_bound_n;
  if (rate > 0.0) {
    for (std::size_t i = 0; i < 3; ++i) {
      const double moved = conditions_.sensor_drift_wanders > 0.5
                               ? rate * std::sqrt(kWalkOverS * step_s_) * random_.normal()
                               : drift_sign_[i] * rate * step_s_;
      drift_n_[i] += moved;
      if (std::abs(drift_n_[i]) > bound) {  // turns back
        drift_n_[i] = std::copysign(bound, drift_n_[i]);
        drift_sign_[i] = drift_n_[i] > 0.0 ? -1.0 : 1.0;
      }
    }
  }
  if (conditions_.sensor_step_n > 0.0) {
    until_jump_s_ -= step_s_;
    if (until_jump_s_ <= 0.0) {
      until_jump_s_ += conditions_.sensor_step_interval_s;
      // Away from zero, then back, then another axis: each is a step of the same size, and the zero stays
      // within one.
      if (jumped_axis_ >= 0) {
        jumped_n_[static_cast<std::size_t>(jumped_axis_)] = 0.0;
        jumped_axis_ = -1;
      } else {
        jumped_axis_ = static_cast<int>(3.0 * random_.uniform());
        jumped_n_[static_cast<std::size_t>(jumped_axis_)] =
            random_.uniform() < 0.5 ? -conditions_.sensor_step_n : conditions_.sensor_step_n;
      }
    }
  }
  offset_n_ = {drift_n_[0] + jumped_n_[0] - conditions_.bias_error_x_n,
               drift_n_[1] + jumped_n_[1] - conditions_.bias_error_y_n,
               drift_n_[2] + jumped_n_[2] - conditions_.bias_error_z_n};
}

}  // namespace hapticd::sim
