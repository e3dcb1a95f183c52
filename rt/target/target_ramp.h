#pragma once

namespace hapticd::rt {

/// A target that moves linearly to each new value, by the measured time. A change never jumps; a ramp of zero
/// seconds takes one period.
class TargetRamp {
 public:
  TargetRamp(double initial, double rate_hz) noexcept : value_(initial), goal_(initial), rate_hz_(rate_hz) {}

  /// From the value in force now to `goal` over `ramp_s`.
  void set(double goal, double ramp_s) noexcept;
  /// Advances `periods` of the loop and returns the value in force.
  double update(double periods = 1.0) noexcept;
  double value() const noexcept { return value_; }
  double goal() const noexcept { return goal_; }

 private:
  double value_;
  double goal_;
  double rate_hz_;
  double step_ = 0.0;
};

}  // namespace hapticd::rt
