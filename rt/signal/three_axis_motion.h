#pragma once

#include <array>
#include <cstdint>

#include "hal/samples.h"
#include "rt/signal/motion_estimator.h"

namespace hapticd::rt {

/// MotionEstimator on each axis of the rig: encoders are read and rounded axis by axis.
class ThreeAxisMotion {
 public:
  ThreeAxisMotion(double position_resolution_mm, double rate_hz) noexcept
      : axes_{MotionEstimator(position_resolution_mm, rate_hz),
              MotionEstimator(position_resolution_mm, rate_hz),
              MotionEstimator(position_resolution_mm, rate_hz)} {}

  void update(const hal::Vector3& position_mm, std::int64_t time_ns) noexcept {
    axes_[0].update(position_mm.x, time_ns);
    axes_[1].update(position_mm.y, time_ns);
    axes_[2].update(position_mm.z, time_ns);
  }
  void reset() noexcept {
    for (MotionEstimator& axis : axes_) axis.reset();
  }
  hal::Vector3 velocity_mm_per_s() const noexcept {
    return {axes_[0].velocity_mm_per_s(), axes_[1].velocity_mm_per_s(), axes_[2].velocity_mm_per_s()};
  }
  hal::Vector3 acceleration_mm_per_s2() const noexcept {
    return {axes_[0].acceleration_mm_per_s2(), axes_[1].acceleration_mm_per_s2(),
            axes_[2].acceleration_mm_per_s2()};
  }

 private:
  std::array<MotionEstimator, 3> axes_;
};

}  // namespace hapticd::rt
