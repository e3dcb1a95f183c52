#pragma once

namespace hapticd::sim {

/// Position, velocity and acceleration of one coordinate.
struct MotionState {
  double position_mm = 0.0;
  double velocity_mm_per_s = 0.0;
  double acceleration_mm_per_s2 = 0.0;
};

/// The motion of least jerk between two states: a polynomial of fifth degree in time (Flash and Hogan 1985).
class MinimumJerk {
 public:
  MinimumJerk() = default;
  /// duration_s > 0.
  MinimumJerk(const MotionState& from, const MotionState& to, double duration_s) noexcept;

  MotionState at(double time_s) const noexcept;
  double duration_s() const noexcept { return duration_s_; }
  bool over(double time_s) const noexcept { return time_s >= duration_s_; }

 private:
  double c_[6] = {};
  double duration_s_ = 0.0;
  MotionState end_;
};

}  // namespace hapticd::sim
