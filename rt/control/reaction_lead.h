#pragma once

#include <algorithm>
#include <cmath>
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
///
/// A structure may be softer or swing slower than the device's data say: there the damping that it takes away
/// may be what kept the loop still. Then the lead changes its sign faster than a hand moves: after kReversals
/// changes of its sign, each within kHalfSwingS of the one before and with at least kSwingN in between, it is
/// given up. It is back with the next contact once it has been still for kStillS. Along one axis
/// only: a tip that strokes over a rough surface makes the reaction swing as well.
class ReactionLead {
 public:
  static constexpr double kCutoffHz = 40.0;
  static constexpr double kSwingN = 0.05;
  static constexpr double kHalfSwingS = 0.06;
  static constexpr int kReversals = 12;
  static constexpr double kStillS = 2.0;

  /// `lead_s` ≥ 0; 0 = off. `gives_way`: it is given up where it swings.
  ReactionLead(double lead_s, double rate_hz, bool gives_way = false) noexcept
      : gain_(lead_s * kOmega), half_step_(0.5 * kOmega / rate_hz), gives_way_(gives_way) {}

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
    const double lead_n = gain_ * (once_n_ - twice_n_);
    since_turn_s_ += interval.s;
    peak_n_ = std::max(peak_n_, std::abs(lead_n));
    if ((lead_n < 0.0) != is_negative_) note_turn(lead_n);
    return is_given_up_ ? 0.0 : lead_n;
  }
  /// A contact begins.
  void begin() noexcept {
    if (since_turn_s_ > kStillS) is_given_up_ = false;
  }
  bool is_given_up() const noexcept { return is_given_up_; }
  void reset() noexcept {
    reaction_n_ = once_n_ = twice_n_ = 0.0;
    is_given_up_ = false;
    turns_ = 0;
  }

 private:
  static constexpr double kOmega = 2.0 * std::numbers::pi * kCutoffHz;

  void note_turn(double lead_n) noexcept {
    is_negative_ = lead_n < 0.0;
    if (peak_n_ < kSwingN) {  // noise: as if it had not turned
      peak_n_ = 0.0;
      return;
    }
    turns_ = since_turn_s_ < kHalfSwingS ? turns_ + 1 : 0;
    since_turn_s_ = peak_n_ = 0.0;
    if (turns_ < kReversals || !gives_way_) return;
    turns_ = 0;
    is_given_up_ = true;
  }

  double gain_;
  double half_step_;  ///< ω T/2 of one period
  bool gives_way_;
  double reaction_n_ = 0.0;    ///< of the tick before
  double once_n_ = 0.0;        ///< the reaction behind one lag
  double twice_n_ = 0.0;       ///< and behind two
  double peak_n_ = 0.0;        ///< of the lead since it turned
  double since_turn_s_ = 0.0;  ///< since it turned last with kSwingN before
  int turns_ = 0;
  bool is_negative_ = false;
  bool is_given_up_ = false;
};

}  // namespace hapticd::rt
