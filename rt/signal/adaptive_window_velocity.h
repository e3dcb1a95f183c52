#pragma once

#include <array>
#include <cstdint>

namespace hapticd::rt {

/// First-order adaptive windowing (Janabi-Sharifi, Hayward, Chen 2000): the velocity is the slope of the
/// longest line that passes within `noise_bound_mm` of all recent positions. A long window while the motion
/// is even, a short one while it changes; the lag is window · period / 2.
class AdaptiveWindowVelocity {
 public:
  static constexpr int kMaxWindow = 15;

  enum class Fit : std::uint8_t {
    kEnd,   ///< line through the window's end points: one pass, by intersecting slope intervals
    kBest,  ///< least squares: less noise, two passes over each window
  };

  /// `noise_bound_mm` bounds the position error: half to one encoder step. Must be > 0.
  AdaptiveWindowVelocity(double noise_bound_mm, double rate_hz, Fit fit = Fit::kEnd) noexcept;

  /// Takes the next position, one period after the last; returns the velocity. The first call after reset()
  /// starts the buffer (at that position, not at zero) and returns 0.
  double update(double position_mm) noexcept;
  void reset() noexcept;

  double velocity_mm_per_s() const noexcept { return velocity_mm_per_s_; }
  /// Periods spanned by the line last fitted; 0 right after the start.
  int window() const noexcept { return window_; }

 private:
  /// 0 = the newest.
  double position(int age) const noexcept { return positions_[static_cast<std::size_t>(newest_ - age)]; }
  void fit_end() noexcept;
  void fit_best() noexcept;

  static constexpr int kHeld = kMaxWindow + 1;

  double noise_bound_mm_;
  double rate_hz_;
  Fit fit_;
  /// A ring, written twice, so that what it holds also stands in one piece, the newest last at newest_.
  std::array<double, 2 * kHeld> positions_{};
  int newest_ = kHeld;
  int filled_ = 0;
  int window_ = 0;
  double velocity_mm_per_s_ = 0.0;
};

}  // namespace hapticd::rt
