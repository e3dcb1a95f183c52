#pragma once

#include <algorithm>
#include <cmath>

#include "rt/signal/stiffness_fit.h"
#include "rt/signal/vector.h"

namespace hapticd::rt {

/// Whether what a sensor reads of nothing is its zero: a reading of less than kMaxN that stays what it is
/// while the tip moves along it by kFarMm, or by kNearMm in a second, or by kAcrossMm in any direction and most of the
/// way back: what strokes an object has its friction turn. An object whose reaction changes so little over that way is
/// softer than the softest that is distinguished from free air (0.02 N/mm). `Value` is a number along the press axis or
/// a vector.
template <class Value>
class BasicReadingInMotion {
 public:
  static constexpr double kMaxN = 0.1;
  static constexpr double kUnchangedN = 0.015;
  static constexpr double kFarMm = 5.0;
  static constexpr double kNearMm = 2.0;
  static constexpr double kNearS = 1.0;
  static constexpr double kAcrossMm = 10.0;
  /// A zero that has shown is taken over with at most that much; the reading moves with it.
  static constexpr double kTakeOverNPerS = 0.05;

  void reset() noexcept { has_begun_ = is_zero_ = false; }

  /// One tick with `reading_n` beyond what a free tool reads. True while it is the zero's.
  bool update(const Value& reading_n, const Value& tip_mm, double s) noexcept {
    if (!(magnitude(reading_n) < kMaxN)) {
      reset();
      return false;
    }
    if (!has_begun_ || magnitude(reading_n - level_n_) > kUnchangedN) {
      has_begun_ = true;
      is_zero_ = false;
      level_n_ = reading_n;
      from_mm_ = tip_mm;
      farthest_mm_ = 0.0;
      s_ = 0.0;
      return false;
    }
    s_ += s;
    if (is_zero_) {
      const Value change_n = reading_n - level_n_;
      const double size_n = magnitude(change_n);
      const double most_n = 1.2 * kTakeOverNPerS * s;
      level_n_ = level_n_ + change_n * (size_n > most_n ? most_n / size_n : 1.0);
      return true;
    }
    // Across it a reading stays what it is on an object, too, that is stroked one way.
    const Value moved = tip_mm - from_mm_;
    const double along_mm = std::abs(stiffness_fit::inner(moved, level_n_)) / magnitude(level_n_);
    const double away_mm = magnitude(moved);
    farthest_mm_ = std::max(farthest_mm_, away_mm);
    is_zero_ = along_mm >= kFarMm || (along_mm >= kNearMm && s_ >= kNearS) ||
               (farthest_mm_ >= kAcrossMm && away_mm < 0.5 * farthest_mm_);
    return is_zero_;
  }

 private:
  bool has_begun_ = false;
  bool is_zero_ = false;
  Value level_n_{};
  Value from_mm_{};
  double farthest_mm_ = 0.0;
  double s_ = 0.0;
};

using ReadingInMotion = BasicReadingInMotion<double>;
using ReadingInMotion3 = BasicReadingInMotion<hal::Vector3>;

}  // namespace hapticd::rt
