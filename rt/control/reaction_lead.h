#pragma once

#include <numbers>

#include "rt/signal/tick_interval.h"

namespace hapticd::rt {

/// How much more the object will push when the force that is asked for now acts: lead × slope of the
/// reaction. The force of (3.3) contains the reaction, which the loop's own delay makes late: while the hand
/// presses on, an object that is rendered softer feels harder, by the delay times the rate at which its
/// reaction grows.
///
/// A full prediction would take as much damping out of a contact as the delay puts in, at every frequency,
/// and so lower the largest stable target. Pressing is slower than what becomes unstable: the slope is that
/// of the reaction behind two equal first-order lags, s/(1 + s/ω)². It is exact for a steady rate, adds in
/// phase at kCutoffHz, and beyond it is late, which damps. With y₁, y₂ behind one lag and two, the slope is
/// ω (y₁ - y₂): bounded by what the force has been, without a difference of noisy values. Trapezoidal rule
/// over the measured interval: second order, exact for a steady rate, stable for any interval.
class ReactionLead {
 public:
  static constexpr double kCutoffHz = 40.0;

  /// `lead_s` ≥ 0; 0 = off.
  ReactionLead(double lead_s, double rate_hz) noexcept
      : gain_(lead_s * kOmega), half_step_(0.5 * kOmega / rate_hz) {}

  bool is_on() const noexcept { return gain_ > 0.0; }
  /// Takes the reaction of a tick, N; returns what to add to it, N. Across a gap nothing is known of the
  /// slope.
  double update(double reaction_n, const TickInterval& interval) noexcept {
    if (interval.is_gap) {
      reaction_n_ = once_n_ = twice_n_ = reaction_n;
      return 0.0;
    }
    const double h = half_step_ * interval.periods;
    const double share = h / (1.0 + h);
    const double once_before_n = once_n_;
    once_n_ += (reaction_n + reaction_n_ - 2.0 * once_n_) * share;
    twice_n_ += (once_n_ + once_before_n - 2.0 * twice_n_) * share;
    reaction_n_ = reaction_n;
    return gain_ * (once_n_ - twice_n_);
  }
  void reset() noexcept { reaction_n_ = once_n_ = twice_n_ = 0.0; }

 private:
  static constexpr double kOmega = 2.0 * std::numbers::pi * kCutoffHz;

  double gain_;
  double half_step_;         ///< ω T/2 of one period
  double reaction_n_ = 0.0;  ///< of the tick before
  double once_n_ = 0.0;      ///< the reaction behind one lag
  double twice_n_ = 0.0;     ///< and behind two
};

}  // namespace hapticd::rt
