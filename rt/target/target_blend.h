#pragma once

#include <algorithm>
#include <cmath>
#include <limits>

#include "rt/target/target_law.h"
#include "rt/target/target_ramp.h"

namespace hapticd::rt {

/// The target in force. A new one fades in over its ramp: the force is a mixture of the two laws whose
/// weights move linearly, so it never jumps, pressed or not. A change that comes while one is under way
/// starts from the mixture's stronger part; what is left of the other would be a jump of at most that rest,
/// and is faded by keeping the force offset. The weights move no faster than the force may change by them.
class TargetBlend {
 public:
  /// `max_change_n_per_s`: of the force at one displacement, by the mixture's change alone.
  TargetBlend(const TargetLaw& law, double rate_hz,
              double max_change_n_per_s = std::numeric_limits<double>::infinity()) noexcept
      : before_(law),
        law_(law),
        rate_hz_(rate_hz),
        max_change_n_(max_change_n_per_s / rate_hz),
        max_damping_n_s_per_mm_(max_target_damping_n_s_per_mm(rate_hz)),
        stiffness_before_(law.stiffness_n_per_mm) {}

  void set(const TargetLaw& law, double ramp_s) noexcept {
    stiffness_before_ = stiffness_n_per_mm();
    before_ = law_;
    law_ = law;
    weight_ = 0.0;
    step_ = 1.0 / std::max(kMinRampPeriods, ramp_s * rate_hz_);
    offset_due_ = true;
  }
  /// Advances by one tick, `periods` of the loop after the last; returns the force at the hand.
  double update(double displacement_mm, double rate_mm_per_s, const hal::Vector3& tip_mm,
                double periods = 1.0) noexcept {
    displacement_mm_ = displacement_mm;
    const double goal_n = law_.force_n(displacement_mm, rate_mm_per_s, tip_mm, max_damping_n_s_per_mm_);
    if (weight_ >= 1.0) return force_n_ = goal_n;
    const double before_n = before_.force_n(displacement_mm, rate_mm_per_s, tip_mm, max_damping_n_s_per_mm_);
    if (offset_due_) offset_n_ = displacement_mm > 0.0 ? force_n_ - before_n : 0.0;
    offset_due_ = false;
    const double from_n = std::max(0.0, before_n + offset_n_);
    const double between_n = std::abs(goal_n - from_n);
    double step = step_ * periods;
    if (step * between_n > max_change_n_ * periods) step = max_change_n_ * periods / between_n;
    weight_ = std::min(1.0, weight_ + step);
    force_n_ = weight_ * goal_n + (1.0 - weight_) * from_n;
    return force_n_;
  }
  /// Lets time pass out of contact: there is nothing to blend.
  void rest(double periods = 1.0) noexcept {
    weight_ = std::min(1.0, weight_ + step_ * periods);
    offset_due_ = false;
    offset_n_ = 0.0;
    force_n_ = displacement_mm_ = 0.0;
  }
  /// Stiffness asked for: between linear targets the mixture in force, else force over displacement of the
  /// last tick.
  double stiffness_n_per_mm() const noexcept {
    if (law_.kind == TargetLaw::Kind::kLinear && before_.kind == TargetLaw::Kind::kLinear) {
      return stiffness_before_ + weight_ * (law_.stiffness_n_per_mm - stiffness_before_);
    }
    return displacement_mm_ > 0.0 ? force_n_ / displacement_mm_ : 0.0;
  }

 private:
  TargetLaw before_;
  TargetLaw law_;
  double rate_hz_;
  double max_change_n_;      ///< in one period
  double max_damping_n_s_per_mm_;
  double stiffness_before_;  ///< reported when the last change came
  double weight_ = 1.0;      ///< of law_
  double step_ = 1.0;
  double force_n_ = 0.0;  ///< last tick's, as its displacement
  double displacement_mm_ = 0.0;
  double offset_n_ = 0.0;  ///< by which a change interrupted another
  bool offset_due_ = false;
};

}  // namespace hapticd::rt
