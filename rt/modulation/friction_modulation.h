#pragma once

#include "hal/samples.h"
#include "rt/modulation/friction_target.h"
#include "rt/signal/tick_interval.h"

namespace hapticd::rt {

/// Changes how much the real object rubs: adds (s - 1) f̂ to the real friction f̂, so that the hand feels s f̂.
///
/// f̂ is what the sensor shows across the normal, as the identified friction law and the direction's filter
/// distinguish it from a turned normal. Presliding stays that of the object: it is f̂ that builds up, over the
/// object's own distance. A Dahl law of the target's own, driven by the encoders, would be a spring of
/// μ f_n/δ, some 10 N/mm: ten times what a device renders stably. Fed back, f̂ needs no such spring. While
/// the tip sticks the loop gain is s - 1. No lead: it excites the structure's mode with the tip clamped.
///
/// Bounds:
///   direction   f̂ counts only along the axis of sliding, which is followed over kAxisMemoryMm and has no
///               sign, and at most kMaxLevel of the identified level: an error of the normal by ε leaks no
///               more than |s - 1| sin ε f_n into the axis, and nothing across it.
///   less        takes energy from friction: no more than kMaxReduction of f̂, and only while the tip slides:
///               the share of it goes to zero below kFadeSpeedMmPerS and after a reversal, over kFadeS. After
///               that, kTurnS after the reversal at the soonest, it grows over kRiseS: a force that comes
///               back sooner is felt as a knock.
///   more        s ≤ kMaxScale, and (s - 1) μ_k f_n ≤ kMaxAddedN: friction turns over with the motion, and
///               beyond that the loop's delay lets device and tip swing faster than the hand slides.
/// The passivity control at the hand's port sees all of it.
class FrictionModulation {
 public:
  static constexpr double kMaxReduction = 0.85;
  static constexpr double kMaxScale = 3.0;
  static constexpr double kMaxAddedN = 1.5;
  static constexpr double kMaxLevel = 1.5;  // of μ_k f_n: static friction is up to 1.4 of it
  static constexpr double kFadeSpeedMmPerS = 5.0;
  static constexpr double kFadeS = 0.06;
  static constexpr double kTurnS = 0.02;  ///< presliding is over by then
  static constexpr double kRiseS = 0.14;
  static constexpr double kAxisMemoryMm = 1.0;
  static constexpr double kLevelS = 0.1;  ///< over which the real level is followed while sliding

  /// `kinetic`: μ_k as identified, > 0.
  FrictionModulation(const FrictionTarget& target, double kinetic) noexcept
      : target_(target), kinetic_(kinetic) {}

  /// What one tick in contact measured, rig frame.
  struct Input {
    hal::Vector3 normal;             ///< out of the object, length 1
    hal::Vector3 friction_n;         ///< f̂ on the tool
    double normal_n = 0.0;           ///< of the object
    double hand_normal_n = 0.0;      ///< of object and device
    hal::Vector3 step_mm;            ///< since the last tick
    hal::Vector3 velocity_mm_per_s;  ///< of the tip
    TickInterval interval;
  };

  /// Force to add on the tip, in the tangent plane. Zero for an input that is not a number.
  hal::Vector3 update(const Input& now) noexcept;
  /// Rests: the tip is out of contact.
  void rest() noexcept;

  /// s in force, after all bounds; 1 = friction as it is.
  double scale() const noexcept { return scale_; }
  /// True if the target asks for more or less than the bounds give.
  bool is_bounded() const noexcept { return is_bounded_; }
  const hal::Vector3& force_n() const noexcept { return force_n_; }

 private:
  void follow_axis(const hal::Vector3& slide_mm, const hal::Vector3& normal) noexcept;
  void follow_fade(double speed_mm_per_s, double s) noexcept;
  /// s that is asked for.
  double wanted_scale(const Input& now, double along_n) noexcept;

  FrictionTarget target_;
  double kinetic_;
  hal::Vector3 axis_;        ///< of sliding; zero before any
  double fade_ = 0.0;        ///< share of a reduction, 0 … 1
  bool may_rise_ = true;     ///< it has been zero since the last reversal
  double last_along_ = 0.0;  ///< sign of the last sliding along the axis
  double since_turn_s_ = 0.0;
  double level_ = 1.0;  ///< of the real coefficient while sliding, over μ_k
  double scale_ = 1.0;
  bool is_bounded_ = false;
  hal::Vector3 force_n_;
};

/// Coefficients at the hand, tangential over normal force, that friction modulation reaches at this load.
struct FrictionRange {
  double min = 0.0;
  double max = 0.0;
};

/// `real_n`: the object's own friction; `spare_n`: what the device has left across the normal. A hand that
/// does not press has no range.
FrictionRange feasible_friction(double real_n, double hand_normal_n, double spare_n) noexcept;

}  // namespace hapticd::rt
