#pragma once

#include "hal/samples.h"

namespace hapticd::rt {

/// Velocity of the tip for what is slow: v += (Δp - v Δt)/(Δt + 7 ms), the same smoothing at any rate and
/// after a late tick. One encoder count of 0.03 mm moves it by 4 mm/s at most.
class ToolSpeed {
 public:
  static constexpr double kSmoothingS = 7e-3;

  /// `interval_s` > 0 since the last time.
  void update(const hal::Vector3& position_mm, double interval_s) noexcept {
    if (is_started_) {
      const hal::Vector3 step_mm = position_mm - position_mm_;
      velocity_mm_per_s_ = velocity_mm_per_s_ +
                           (step_mm - velocity_mm_per_s_ * interval_s) * (1.0 / (interval_s + kSmoothingS));
    }
    is_started_ = true;
    position_mm_ = position_mm;
  }
  void reset() noexcept { *this = {}; }
  const hal::Vector3& velocity_mm_per_s() const noexcept { return velocity_mm_per_s_; }

 private:
  bool is_started_ = false;
  hal::Vector3 position_mm_;
  hal::Vector3 velocity_mm_per_s_;
};

}  // namespace hapticd::rt
