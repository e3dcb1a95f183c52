#pragma once

#include <cstdint>

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
class ForceController {
 public:
  ForceController(const ControllerParameters& parameters, double rate_hz) noexcept;

  double update(double desired_force_n) noexcept;
  /// Takes what the device was really given: the observer's f_d for the next tick.
  void applied(double force_n) noexcept { device_force_n_ = force_n; }
  void reset() noexcept;
  double device_force_n() const noexcept { return device_force_n_; }

 private:
  ControlLaw law_;
  double proportional_gain_;
  double derivative_gain_per_sample_;
  double device_force_n_ = 0.0;
  double last_error_n_ = 0.0;
};

}  // namespace hapticd::rt
