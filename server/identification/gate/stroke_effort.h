#pragma once

#include <algorithm>

#include "server/identification/gate/sample_policy.h"

namespace hapticd::identification {

/// Limits how hard strokes are asked for: after the tip stuck under a press, or the sensor came to the end of
/// its range, the next ones have to be lighter. A tip that sticks draws itself deeper in, so what counts is
/// the hardest force of the contact, not the one that was asked for. In constant time and memory.
class StrokeEffort {
 public:
  static constexpr double kMinStrokeS = 1.0;    ///< a shorter one does not count as a stroke
  static constexpr double kStuckS = 0.15;       ///< a stroke that slides less than this stuck
  static constexpr double kSaturatedS = 0.05;   ///< so long at the end of the range is more than a spike
  static constexpr double kPressedShare = 0.5;  ///< of the hardest force: neither set down nor lifted off
  static constexpr double kLighter = 0.5;       ///< times the hardest force

  /// Takes each fit sample in contact.
  void touch(double now_s, double force_n, bool slides) noexcept {
    const double step_s = count(now_s);
    contact_s_ += step_s;
    hardest_n_ = std::max(hardest_n_, force_n);
    // A tip that stuck slides as it is set down and lifted off.
    if (slides && force_n > kPressedShare * hardest_n_) sliding_s_ += step_s;
  }
  /// Takes each sample with the sensor at the end of its range.
  void saturate(double now_s) noexcept { saturated_s_ += count(now_s); }
  /// Ends the contact: the tip is free.
  void release() noexcept {
    const bool stuck = contact_s_ > kMinStrokeS && sliding_s_ < kStuckS;
    if (hardest_n_ > 0.0 && (stuck || saturated_s_ > kSaturatedS)) {
      limit_n_ = std::min(limit_n_, kLighter * hardest_n_);
    }
    contact_s_ = sliding_s_ = saturated_s_ = hardest_n_ = 0.0;
    counts_ = false;
  }

  /// Force to ask for if `force_n` is wanted; no less than `min_n`.
  double asked_n(double force_n, double min_n) const noexcept {
    return std::min(force_n, std::max(min_n, limit_n_));
  }
  /// Force above which no stroke is asked for; practically none before one was too hard.
  double limit_n() const noexcept { return limit_n_; }

 private:
  double count(double now_s) noexcept {
    const double step_s = counts_ ? now_s - last_s_ : 0.0;
    counts_ = true;
    last_s_ = now_s;
    return step_s > 0.0 && step_s < kMaxSampleStepS ? step_s : 0.0;
  }

  bool counts_ = false;
  double last_s_ = 0.0;
  double contact_s_ = 0.0, sliding_s_ = 0.0, saturated_s_ = 0.0, hardest_n_ = 0.0;
  double limit_n_ = 1e9;
};

}  // namespace hapticd::identification
