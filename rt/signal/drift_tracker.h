#pragma once

#include <algorithm>

#include "hal/samples.h"

namespace hapticd::rt {

/// Follows what drifts, and lets it drift on while it cannot be seen.
///
/// The filter is of second order and critically damped: value' = ρ + 2 ω e, ρ' = ω² e - ρ/τ, e the error,
/// within ±kMaxErrorN on each axis. A steady drift is followed ρ/(τ ω²) late, 0.7 mN at 5 mN/s, and ρ/(2.7 ω)
/// = 5 mN while it is learnt (twice that if it turns back). A step is overshot by 14 %. What moves to and fro
/// with the hand averages out; what is further off than kMaxErrorN is a step or an object, and teaches no
/// rate. Unseen, the drift goes on and is forgotten with τ: a rate that is wrong by 0.5 mN/s makes an error
/// of 30 mN at most, after whatever time. Explicit Euler steps, stable for steps below 2/ω.
class DriftTracker {
 public:
  static constexpr double kOmegaPerS = 0.35;
  static constexpr double kForgetsS = 60.0;
  static constexpr double kMaxErrorN = 0.012;
  /// A sensor that warms up drifts by less; what grows faster may be an object.
  static constexpr double kMaxRateNPerS = 6e-3;

  const hal::Vector3& value_n() const noexcept { return value_n_; }
  const hal::Vector3& rate_n_per_s() const noexcept { return rate_n_per_s_; }

  /// Lets `s` pass.
  void drift_on(double s) noexcept {
    value_n_ = value_n_ + rate_n_per_s_ * s;
    rate_n_per_s_ = rate_n_per_s_ * (1.0 - s * (1.0 / kForgetsS));
  }
  /// Corrects it by what was seen to be missing, for `s`. `at_rest`: only then does it teach the rate, for
  /// what a motion leaves in a reading lasts as long as the motion.
  void follow(const hal::Vector3& error_n, double s, bool at_rest) noexcept {
    const hal::Vector3 e = clamped(error_n, kMaxErrorN);
    value_n_ = value_n_ + e * (2.0 * kOmegaPerS * s);
    if (!at_rest || dot(error_n - e, error_n - e) > 0.0) return;
    rate_n_per_s_ = clamped(rate_n_per_s_ + e * (kOmegaPerS * kOmegaPerS * s), kMaxRateNPerS);
  }
  /// Shifts what it is at present.
  void shift(const hal::Vector3& by_n) noexcept { value_n_ = value_n_ + by_n; }

 private:
  static constexpr hal::Vector3 clamped(const hal::Vector3& v, double bound) noexcept {
    return {std::clamp(v.x, -bound, bound), std::clamp(v.y, -bound, bound), std::clamp(v.z, -bound, bound)};
  }

  hal::Vector3 value_n_;
  hal::Vector3 rate_n_per_s_;
};

}  // namespace hapticd::rt
