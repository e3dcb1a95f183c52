#pragma once

#include <algorithm>
#include <cmath>

namespace hapticd::rt {

/// A contact is rendered from the first evidence of it on, some tenths of a millimetre after it began. What
/// the target's force is ahead of the reaction there would be felt as a step, or as a slope of several times
/// the target's. So it is taken off, and fades in:
///
///   begin   δ = f~ - f_r: the hand feels on what it felt, from there on with the target's slope.
///   then    δ = D - kFadeShare f~, with the D that gives the δ of the beginning: the slope at the hand is
///           steeper than the target's by that share at most. The same on the way in and out: a force that
///           came late on the way in and was all there on the way out would give energy to a tool that
///           bounces. A target softer than what is touched is rendered at once (δ is never below 0): that
///           makes the slope less steep.
///   hold    D fades with kHoldS: a hold ends exact. A slow press that an encoder shows step by step is not a
///           hold: what counts is the mean speed of late as well.
///   bound   what a bound of the force holds back joins δ, so what comes after the bound makes no step
///   either.
///
/// Exact for any target law, as it goes by forces. δ is never more than the target's force. The device's own
/// friction is compensated by the share that is rendered: all of it at once would throw the tip forward.
class LateOnset {
 public:
  static constexpr double kFadeShare = 0.32;
  static constexpr double kHoldS = 0.2;
  static constexpr double kHoldMmPerS = 3.0;  ///< slower may be a hold
  static constexpr double kHoldMeanMmPerS = 0.5;
  static constexpr double kSpeedMeanS = 0.1;

  /// Resets: no contact, or a new one.
  void reset() noexcept { *this = {}; }
  bool has_begun() const noexcept { return has_begun_; }

  /// Advances by one tick: the target's force, with the reaction in the tick in which rendering begins.
  /// Returns δ, N.
  double update(double target_n, double reaction_n, double speed_mm_per_s, double s) noexcept {
    target_n_ = std::max(0.0, target_n);
    if (!has_begun_) {
      has_begun_ = true;
      begin_with(target_n - reaction_n);
      speed_mm_per_s_ = speed_mm_per_s;
    } else {
      speed_mm_per_s_ += (speed_mm_per_s - speed_mm_per_s_) * (s / (s + kSpeedMeanS));
      const double held = std::max(0.0, 1.0 - std::max(std::abs(speed_mm_per_s) / kHoldMmPerS,
                                                       std::abs(speed_mm_per_s_) / kHoldMeanMmPerS));
      late_n_ /= 1.0 + held * s / kHoldS;
    }
    return missing_n();
  }
  /// Makes the target's force `more_n` less than asked for.
  void hold_back(double more_n) noexcept { begin_with(missing_n() + more_n); }
  double missing_n() const noexcept { return std::clamp(late_n_ - kFadeShare * target_n_, 0.0, target_n_); }
  /// Share of the target's force that is not missing, 0 … 1.
  double rendered_share() const noexcept {
    if (late_n_ <= kFadeShare * target_n_) return 1.0;
    return target_n_ > 0.0 ? 1.0 - missing_n() / target_n_ : 0.0;
  }

 private:
  void begin_with(double missing_n) noexcept {
    late_n_ = std::clamp(missing_n, 0.0, target_n_) + kFadeShare * target_n_;
  }

  bool has_begun_ = false;
  double speed_mm_per_s_ = 0.0;  ///< mean of late
  double late_n_ = 0.0;          ///< D
  double target_n_ = 0.0;        ///< f~
};

}  // namespace hapticd::rt
