#pragma once

#include <limits>

namespace hapticd::rt {

/// A ramp of zero seconds ends at the next tick, also if that one follows in less than a whole period.
inline constexpr double kMinRampPeriods = 1e-3;

/// A target that moves linearly to each new value, by the measured time. Where an object is pressed it moves
/// no faster than the force may change by it.
class TargetRamp {
 public:
  /// `max_change_n_per_s`: of target × displacement, by the target's change alone.
  TargetRamp(double initial, double rate_hz,
             double max_change_n_per_s = std::numeric_limits<double>::infinity()) noexcept
      : value_(initial), goal_(initial), rate_hz_(rate_hz), max_change_n_(max_change_n_per_s / rate_hz) {}

  /// Goes from the value in force now to `goal` over `ramp_s`.
  void set(double goal, double ramp_s) noexcept;
  /// Advances `periods` of the loop, pressed in by `displacement_mm`, and returns the value in force.
  double update(double periods = 1.0, double displacement_mm = 0.0) noexcept;
  double value() const noexcept { return value_; }
  double goal() const noexcept { return goal_; }

 private:
  double value_;
  double goal_;
  double rate_hz_;
  double max_change_n_;  ///< in one period
  double step_ = 0.0;
};

}  // namespace hapticd::rt
