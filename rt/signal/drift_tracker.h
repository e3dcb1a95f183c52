#pragma once

#include <utility>

#include "hal/samples.h"
#include "rt/signal/vector.h"

namespace hapticd::rt {

/// Follows what drifts, and lets it drift on while it cannot be seen.
///
/// The filter is of second order and critically damped while the tool rests: value' = ρ + 2 ω e, ρ' = ω² e - ρ/τ, e
/// the error, no longer than kMaxErrorN. A steady drift is followed ρ/(τ ω²) late, 0.1 mN at 5 mN/s, and ρ/(2.7 ω) =
/// 2 mN while it is learnt (twice that if it turns back). A step is overshot by 14 %; what is further off than
/// kTeachesN is a step or an object, and teaches no rate. In motion the value is corrected more slowly, and the rate
/// kept: what a motion leaves in a reading lasts as long as the motion. Unseen, the drift goes on, is forgotten with
/// τ, and makes no more than kMaxUnseenN, less than every scene takes for a zero: a slow touch may have taught the
/// rate. Explicit Euler steps, stable for steps below 2/ω.
class DriftTracker {
 public:
  static constexpr double kOmegaPerS = 1.0;
  static constexpr double kMovingPerS = 0.7;
  static constexpr double kForgetsS = 60.0;
  /// Largest error that is corrected at once, by 6 mN/s: what goes on to grow faster is an object.
  static constexpr double kMaxErrorN = 0.003;
  static constexpr double kTeachesN = 0.008;
  /// A sensor that warms up drifts by less, 5 mN/s on each of three axes.
  static constexpr double kMaxRateNPerS = 0.01;
  static constexpr double kMaxUnseenN = 0.09;

  const hal::Vector3& value_n() const noexcept { return value_n_; }
  const hal::Vector3& rate_n_per_s() const noexcept { return rate_n_per_s_; }

  /// Lets `s` pass.
  void drift_on(double s) noexcept {
    hal::Vector3 by_n = rate_n_per_s_ * s;
    rate_n_per_s_ = rate_n_per_s_ * (1.0 - s * (1.0 / kForgetsS));
    if (std::exchange(is_seen_, false)) {
      unseen_n_ = by_n;
    } else {
      const hal::Vector3 unseen_n = unseen_n_ + by_n;
      if (exceeds(unseen_n, kMaxUnseenN)) by_n = within(unseen_n, kMaxUnseenN) - unseen_n_;
      unseen_n_ = unseen_n_ + by_n;
    }
    value_n_ = value_n_ + by_n;
  }
  /// Corrects it by what was seen to be missing, for `s`.
  void follow(const hal::Vector3& error_n, double s, bool at_rest) noexcept {
    const hal::Vector3 e = within(error_n, kMaxErrorN);
    value_n_ = value_n_ + e * ((at_rest ? 2.0 * kOmegaPerS : kMovingPerS) * s);
    is_seen_ = true;
    if (!at_rest || exceeds(error_n, kTeachesN)) return;
    rate_n_per_s_ = within(rate_n_per_s_ + e * (kOmegaPerS * kOmegaPerS * s), kMaxRateNPerS);
  }
  /// Shifts what it is at present.
  void shift(const hal::Vector3& by_n) noexcept { value_n_ = value_n_ + by_n; }

 private:
  hal::Vector3 value_n_;
  hal::Vector3 rate_n_per_s_;
  hal::Vector3 unseen_n_;  ///< what it has drifted by since it was seen
  bool is_seen_ = true;    ///< since the last step of the drift
};

}  // namespace hapticd::rt
