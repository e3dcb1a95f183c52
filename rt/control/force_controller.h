#pragma once

#include <cstdint>

#include "hal/samples.h"

namespace hapticd::rt {

enum class ControlLaw : std::uint8_t {
  kClosedLoop,  ///< (3.6): the command integrates the force error
  kOpenLoop,    ///< the desired force is the command, as in ordinary virtual-wall rendering
};

/// Gains of (3.6). The derivative gain is in milliseconds by name: the published 0.01-0.03 act on the change
/// of the error per sample at 1 kHz, and mean something else per second.
struct ControllerParameters {
  ControlLaw law = ControlLaw::kClosedLoop;
  double proportional_gain = 0.0;  ///< Kp, per sample; 0 until resolve() fills in the device's own
  double derivative_gain_ms = 0.0;
};

/// Kd', which acts on the change from one sample to the next.
constexpr double derivative_gain_per_sample(const ControllerParameters& parameters, double rate_hz) noexcept {
  return parameters.derivative_gain_ms * 1e-3 * rate_hz;
}

/// True inside the controller's own stability region. With the observer f_d(k) = f_c(k-1) its characteristic
/// polynomial is z² - (1 - Kp - Kd') z - Kd', Kd' = derivative_gain / period: stable iff
/// Kp > 0, |Kd'| < 1 and Kp + 2 Kd' < 2.
bool gains_are_stable(const ControllerParameters& parameters, double rate_hz) noexcept;

/// The slowest controller: time constant T/Kp.
inline constexpr double kMaxControllerTimeS = 0.02;

/// True if the controller settles: it is stable, its slowest pole is within 1 - T/kMaxControllerTimeS (Kp ≥
/// T/20 ms without Kd'), and what alternates or swings - poles that are negative or complex - fades by a
/// quarter each sample. So a step of the desired force is followed to 5 % within 60 ms and rings for no more
/// than ten samples.
bool gains_settle(const ControllerParameters& parameters, double rate_hz) noexcept;

/// f_c(k) = f_c(k-1) + Kp f_e(k) + Kd' (f_e(k) - f_e(k-1)), f_e = f~_d - f_c(k-1).   (3.6)
/// `Value` is the force along an axis, or a vector in the rig frame (4.24).
template <class Value>
class BasicForceController {
 public:
  BasicForceController(const ControllerParameters& parameters, double rate_hz) noexcept
      : law_(parameters.law),
        proportional_gain_(parameters.proportional_gain),
        derivative_gain_per_sample_(derivative_gain_per_sample(parameters, rate_hz)) {}

  /// `gain_share`: of Kp, 0 … 1.
  Value update(const Value& desired_force_n, double gain_share = 1.0) noexcept {
    if (law_ == ControlLaw::kOpenLoop) return desired_force_n;
    const Value error = desired_force_n - device_force_n_;
    const Value change = error - last_error_n_;
    last_error_n_ = error;
    return device_force_n_ + error * (gain_share * proportional_gain_) + change * derivative_gain_per_sample_;
  }
  /// Takes what the device was really given: the observer's f_d for the next tick.
  void applied(const Value& force_n) noexcept { device_force_n_ = force_n; }
  void reset() noexcept { device_force_n_ = last_error_n_ = Value{}; }
  const Value& device_force_n() const noexcept { return device_force_n_; }

 private:
  ControlLaw law_;
  double proportional_gain_;
  double derivative_gain_per_sample_;
  Value device_force_n_{};
  Value last_error_n_{};
};

using ForceController = BasicForceController<double>;
using ThreeAxisController = BasicForceController<hal::Vector3>;

}  // namespace hapticd::rt
