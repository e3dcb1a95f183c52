#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <type_traits>

#include "hal/samples.h"
#include "rt/signal/even_line.h"

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
  static constexpr std::size_t kAxes = std::is_same_v<Value, double> ? 1 : 3;
  static constexpr std::size_t kPoints = kMaxWindow + 1;
  static constexpr int kWidestSpacing = 10;  ///< ticks: kSpacingS at 10 kHz

  /// A ring, written twice, so that the points of a window lie in one piece, the newest first.
  using Ring = std::array<double, 2 * kPoints>;
  /// Readings that are a whole number of spacings apart.
  struct Readings {
    Ring periods{};                          ///< when, since the start
    std::array<Ring, kAxes> positions_mm{};  ///< of each axis
    std::array<EvenLine, kAxes> lines{};     ///< of its longest window
  };

  void take(const Value& position_mm, double periods) noexcept;
  void fit_first() noexcept;
  void fit_end() noexcept;
  void fit_best() noexcept;

  double noise_bound_mm_;
  double rate_hz_;
  int spacing_;  ///< ticks between two points of the window
  Fit fit_;
  std::array<Readings, kWidestSpacing> readings_{};
  std::size_t phase_ = 0;   ///< which of readings_ the newest is among
  std::size_t newest_ = 0;  ///< its place there; the point before it is at the next place
  double periods_ = 0.0;    ///< of the newest, since the start
  Value first_mm_{};        ///< the first reading since the start
  int filled_ = 0;          ///< readings since the start, up to what fills the longest window
  int points_ = 0;          ///< before the newest, since the start, up to the longest window
  int window_ = 0;
  std::array<bool, kAxes> was_even_{};  ///< the last line of the axis spanned the longest window
  Value velocity_mm_per_s_{};
};

using AdaptiveWindowVelocity = BasicAdaptiveWindowVelocity<double>;
using AdaptiveWindowVelocity3 = BasicAdaptiveWindowVelocity<hal::Vector3>;

}  // namespace hapticd::rt
