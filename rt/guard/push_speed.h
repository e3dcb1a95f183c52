#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <utility>

#include "hal/samples.h"

namespace hapticd::rt {

/// How fast the tip moves along a force, for a bound on power: never slow to see a real motion, never taken
/// in by a single encoder count. Times are measured, so that neither the rate nor a late tick changes the
/// answer.
///
/// Two estimates, the larger counts:
/// - smoothed over kSmoothingS: v += (Δp - v Δt)/(Δt + kSmoothingS), the same time at any rate. One count of
///   0.03 mm moves it by at most 0.03 mm/7 ms = 4.3 mm/s (also at 10 kHz, where the raw difference is
///   300 mm/s): 0.036 W at 8.5 N, 1.8 % of the 2 W allowed;
/// - prompt: the path since places of the last 6 … 8 ms, less kCountsMm, by its time. It is zero for a few
///   counts and follows a jump of speed at once: what is given beyond the bound while the smoothed one rises
///   is at most 4 · force · kCountsMm, 3 mJ at 8 N, and the tick before the motion shows.
class PushSpeed {
 public:
  static constexpr double kSmoothingS = 7e-3;  ///< eight ticks of 1 kHz
  static constexpr double kCountsMm = 0.1;     ///< three counts of the coarsest device at once

  /// The tip was at `position_mm`, `interval_s` > 0 after the last time. Returns its step since then, zero at
  /// the first position.
  hal::Vector3 update(const hal::Vector3& position_mm, double interval_s) noexcept {
    if (count_ == 0) {
      now_.position_mm = position_mm;
      remember();
      return {};
    }
    const hal::Vector3 step_mm = position_mm - now_.position_mm;
    follow_fastest(step_mm, interval_s);
    smoothed_mm_per_s_ =
        smoothed_mm_per_s_ + (step_mm - smoothed_mm_per_s_ * interval_s) * (1.0 / (interval_s + kSmoothingS));
    if (now_.time_s - places_[(count_ - 1) % kPlaces].time_s >= kSpacingS) remember();
    now_ = {position_mm, now_.time_s + interval_s};
    return step_mm;
  }
  /// A position was missed: what is known of the speed is over.
  void reset() noexcept { *this = {}; }

  /// mm/s along `direction`, a unit vector. Zero or negative: nothing is given. Below `matters_mm_per_s` it
  /// need not be exact: while no two positions were that far apart, only the smoothed speed is looked at.
  double along_mm_per_s(const hal::Vector3& direction, double matters_mm_per_s = 0.0) const noexcept {
    double speed = dot(smoothed_mm_per_s_, direction);
    if (std::max(fastest_, fastest_before_) < matters_mm_per_s * matters_mm_per_s) return speed;
    for (std::size_t back = 1; back <= kPlaces && back <= count_; ++back) {
      const Place& then = places_[(count_ - back) % kPlaces];
      const double elapsed_s = now_.time_s - then.time_s;
      if (elapsed_s > kMaxPathS) break;
      const double path_mm = dot(now_.position_mm - then.position_mm, direction) - kCountsMm;
      if (path_mm > speed * elapsed_s) speed = std::max(0.0, path_mm / elapsed_s);
    }
    return speed;
  }

 private:
  static constexpr std::size_t kPlaces = 32;  // a power of two: the count may wrap
  static constexpr double kSpacingS = 0.19e-3;
  static constexpr double kMaxPathS = 8.1e-3;
  struct Place {
    hal::Vector3 position_mm;
    double time_s = 0.0;
  };
  void remember() noexcept { places_[count_++ % kPlaces] = now_; }
  /// The largest speed between two positions, of more than the last kMaxPathS: no path is faster.
  void follow_fastest(const hal::Vector3& step_mm, double interval_s) noexcept {
    if (now_.time_s - fastest_since_s_ > kMaxPathS) {
      fastest_before_ = std::exchange(fastest_, 0.0);
      fastest_since_s_ = now_.time_s;
    }
    fastest_ = std::max(fastest_, dot(step_mm, step_mm) / (interval_s * interval_s));
  }

  std::array<Place, kPlaces> places_{};
  std::size_t count_ = 0;
  Place now_;
  hal::Vector3 smoothed_mm_per_s_;
  double fastest_ = 0.0;         ///< squared, since fastest_since_s_
  double fastest_before_ = 0.0;  ///< and in the kMaxPathS before that
  double fastest_since_s_ = 0.0;
};

}  // namespace hapticd::rt
