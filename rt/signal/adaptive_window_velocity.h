#pragma once

#include <array>
#include <cstdint>

#include "hal/samples.h"

namespace hapticd::rt {

/// First-order adaptive windowing (Janabi-Sharifi, Hayward, Chen 2000): the velocity is the slope of the
/// longest line that passes within `noise_bound_mm` of all recent positions. A long window while the motion
/// is even, a short one while it changes; the lag is window · period / 2.
///
/// Noise goes with the bound over the window's time, so the window's points lie a millisecond apart if ticks
/// are shorter: as many points, as long a window and as quiet a velocity, brought up to date at every tick.
/// Slopes are taken over the measured times of the positions, so a late tick does not show as velocity.
/// `Value` is one position, or a vector of three that are measured at the same instants: encoders are read
/// and rounded axis by axis, so each axis has its own window; the times are taken once for all of them.
template <class Value>
class BasicAdaptiveWindowVelocity {
 public:
  static constexpr int kMaxWindow = 15;  ///< points before the newest
  static constexpr double kSpacingS = 1e-3;

  enum class Fit : std::uint8_t {
    kEnd,   ///< line through the window's end points: one pass, by intersecting slope intervals
    kBest,  ///< least squares: less noise, two passes over each window
  };

  /// `noise_bound_mm` bounds the position error: half to one encoder step. Must be > 0.
  BasicAdaptiveWindowVelocity(double noise_bound_mm, double rate_hz, Fit fit = Fit::kEnd) noexcept;

  /// Takes the next position, measured `periods` (> 0) of the loop after the last; returns the velocity. The
  /// first call after reset() starts the buffer (at that position, not at zero) and returns 0.
  const Value& update(const Value& position_mm, double periods = 1.0) noexcept;
  void reset() noexcept;

  const Value& velocity_mm_per_s() const noexcept { return velocity_mm_per_s_; }
  /// Ticks spanned by the line last fitted, the shortest of the axes; 0 right after the start.
  int window() const noexcept { return window_; }

 private:
  struct Reading {
    Value position_mm{};
    double periods = 0.0;  ///< when, since the start
  };

  /// `points` before the newest.
  const Reading& reading(int points) const noexcept {
    return readings_[static_cast<std::size_t>(newest_ - points * spacing_)];
  }
  void fit_first() noexcept;
  void fit_end() noexcept;
  void fit_best() noexcept;

  static constexpr int kWidestSpacing = 10;  ///< ticks: kSpacingS at 10 kHz
  static constexpr int kMaxHeld = kMaxWindow * kWidestSpacing + 1;

  double noise_bound_mm_;
  double rate_hz_;
  int spacing_;  ///< ticks between two points of the window
  int held_;     ///< positions of the longest window
  Fit fit_;
  /// A ring, written twice, so that what it holds also is in one piece, the newest last at newest_.
  std::array<Reading, 2 * kMaxHeld> readings_{};
  int newest_;
  int filled_ = 0;
  int points_ = 0;  ///< before the newest, since the start, up to the longest window
  int window_ = 0;
  Value velocity_mm_per_s_{};
};

using AdaptiveWindowVelocity = BasicAdaptiveWindowVelocity<double>;
using AdaptiveWindowVelocity3 = BasicAdaptiveWindowVelocity<hal::Vector3>;

}  // namespace hapticd::rt
