#pragma once

#include <cstdint>

#include "hal/samples.h"
#include "rt/deformation/friction_filter.h"
#include "rt/friction/friction_model.h"

namespace hapticd::rt {

/// Deformation direction and friction, estimated together.
///
/// One reaction cannot distinguish a turned surface from a changed friction: f_r = f_n (u - φ) - μ_b v_t,
/// with φ the friction coefficient as a vector in the tangent plane. But they change on different occasions.
/// The normal turns only where the tip moves on, by its path over the radius of the surface. Friction follows
/// its law (Dahl's, or that of Maxwell-slip elements: see FrictionFilter) while the tip slides, and is
/// not known while it sticks: held by its own dry friction, the device does not see the tip bend the
/// asperities, and φ may pass from one side to the other with the encoders at rest. So a Kalman filter
/// carries both, isotropic in the tangent plane (covariance 2 × 2): sliding, the reaction's direction is
/// known to the friction's few per cent and corrects the normal; at rest the normal stays and the reaction
/// shows φ.
///
/// Steps and reactions of a millisecond are taken together if ticks are shorter: an encoder moves by counts,
/// on one axis at a time, and whether a motion slides or presses cannot be distinguished from a single count.
///
/// Pressing straight down and sliding down a slope as steep as the friction look alike: the same motion, the
/// same force. A normal that is slightly off would see sliding in every press and confirm itself. Motion
/// across the normal therefore counts as sliding only beyond what a slant of kSlantOfPressing explains.
///
/// A device that pulls along the normal to soften an object moves the tool across it if the normal is off,
/// and the friction that this turns over looks like a turned normal again: with a pull of 10 N on a rubber
/// ball the two swing by 50° at 28 Hz. Once it has settled the normal therefore turns no faster than
/// kFastestTurnRadPerS: a stroke of 150 mm/s over kTightestRadiusMm follows, a swing does not build up.
class TrackedDirection {
 public:
  /// `force_noise_n`: standard deviation of one component per tick.
  TrackedDirection(const FrictionParameters& friction, double force_noise_n, double rate_hz) noexcept;

  void begin(const hal::Vector3& reaction_n) noexcept;
  /// Takes, in the rig frame, the reaction on the tool, the motion of the tip since the last tick, `periods`
  /// ago, and its velocity.
  void update(const hal::Vector3& reaction_n, const hal::Vector3& step_mm,
              const hal::Vector3& velocity_mm_per_s, double periods = 1.0) noexcept;

  /// u, out of the object, length 1.
  const hal::Vector3& normal() const noexcept { return normal_; }
  /// Friction on the tool.
  const hal::Vector3& friction_n() const noexcept { return friction_n_; }
  /// Standard deviation of u as the filter sees it.
  double deviation_rad() const noexcept;

 private:
  /// `interval_s`: since the last correction.
  void correct(const hal::Vector3& reaction_n, const hal::Vector3& step_mm,
               const hal::Vector3& velocity_mm_per_s, double interval_s) noexcept;
  /// Gives the normal what exceeds a few times the friction of sliding: no friction holds more than that.
  void give_back_excess() noexcept;
  /// Limits the turn from `before` to what a surface can do in `interval_s`.
  void limit_turn(const hal::Vector3& before, double interval_s) noexcept;

  static constexpr double kUpdateS = 1e-3;
  static constexpr double kMaxStatic = 2.5;          // of μ_k; 2.2 for a sticky gel
  static constexpr double kTightestRadiusMm = 15.0;  // of what is stroked without lifting off
  static constexpr double kDriftRadPerS = 0.02;      // the direction of a soft object under a tip at rest
  static constexpr double kFrictionError = 0.07;     // of μ_k, while sliding: D§4.4.1 reports 7-15 %
  static constexpr double kSlantOfPressing = 0.3;
  static constexpr double kOnsetDisorder = 10.0;     // an impact's force is off by more than the sensor's
                                                     // noise
  static constexpr double kStuckTimeS = 0.1;         // in which friction may change altogether, at rest
  static constexpr double kStuckMmPerS = 4.0;        // slower than this the encoders may be blind to sliding
  static constexpr double kFirstDeviationRad = 0.3;  // of the first reaction from the normal
  static constexpr double kFastestTurnRadPerS = 7.0;
  static constexpr double kSettlingS = 0.05;  // of a contact; in this time the normal turns freely

  FrictionParameters friction_;
  std::uint32_t ticks_per_update_;
  double period_s_;  ///< of the loop
  double force_variance_n2_;
  hal::Vector3 normal_{0.0, 0.0, 1.0};
  FrictionFilter friction_state_;  ///< φ, along the sliding
  hal::Vector3 friction_n_;
  double normal_variance_ = 0.0;
  double touching_s_ = 0.0;     ///< since begin()
  std::uint32_t gathered_ = 0;  ///< ticks since the last update
  double gathered_periods_ = 0.0;
  hal::Vector3 gathered_step_mm_{};  ///< sum of their steps
  hal::Vector3 gathered_n_{};        ///< sum of their reactions
};

}  // namespace hapticd::rt
