#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>

#include "rt/signal/stiffness_fit.h"
#include "rt/signal/tick_interval.h"
#include "rt/signal/tool_compensation.h"

namespace hapticd::rt {

/// What a contact must show before force is rendered on it.
struct EvidenceParameters {
  /// False renders every declared contact in full, as published: for comparisons only, no scene can ask for
  /// it.
  bool required = true;
  /// Largest force F_0 that a sensor may read without a load: its zero, its cross-talk, a tool of another
  /// mass. Full authority is reached at twice that. 0 = 0.1, or twice the threshold if that is more: steps of
  /// 50 mN on three axes, and a little.
  double unexplained_force_n = 0.0;
  /// An object yields no more than this lets it; what is softer is not distinguished from free air.
  double lowest_stiffness_n_per_mm = 0.02;
};

inline double default_unexplained_force_n(double threshold_n) noexcept {
  return std::max(0.1, 2.0 * threshold_n);
}

/// Whether a declared contact is one, and how much force may be rendered on it.
///
/// A threshold says that the sensor reads something; a wrong zero, a wrong mass, a late or skewed sample do
/// that too. An object shows itself by more: its reaction exceeds all that free motion could leave, and goes
/// with the displacement. So authority a, 0 … 1, is earned and can be lost:
///
///   earned   E = f - F_0 - m A, A the envelope of the tip's acceleration; a grows to E/F_0 at the level of E
///            that lasted kSustainedS, for encoders show a motion that late. What exceeds even the
///            acceleration a hand may reach unseen, m kUnseenMmPerS2, counts at once. A smaller E takes
///            nothing away again.
///   sloped   where f regressed on the path and the acceleration since the contact began grows with the path
///            by more than free air's noise explains (StiffnessFit), and goes on to grow in a second fit that
///            begins there, which a step of the reading does not: a is 1 from then on, but no more than
///            kSlopeForceN is rendered until E has earned the rest. A constant takes zero, tilt and weight,
///            so that holds from some hundredths of a newton on.
///   lost     by the factor s = min((f/(K x) - 0.15)/0.2, (f/ε_f - 1)/2), 0 … 1, K the contact's own secant
///            stiffness followed over kSecantS: the reaction falls to a third of what this depth gave, or to
///            the threshold, and force with it. At s = 0 for kLostS there is no object any more, and the
///            contact has ended.
///   never    where f < k_min (x - kFreePathMm) for kLostS: the tip went on and nothing resisted.
///
/// f is the reaction along the deformation direction, x its displacement. Nothing is rendered before a > 0.
class ContactEvidence {
 public:
  /// `threshold_n`: ε_f; `tool_mass_g`: m, beyond the sensor.
  ContactEvidence(const EvidenceParameters& parameters, double threshold_n, double tool_mass_g) noexcept;

  static constexpr double kDeflectionError = 0.25;  // of it: the motors bend the structure later than asked

  /// What one tick of contact measured.
  struct Observation {
    double reaction_n = 0.0;       ///< f
    double displacement_mm = 0.0;  ///< x, as it is rendered
    double path_mm = 0.0;          ///< of the tip into the object since the onset, without any contact law
    double acceleration_mm_per_s2 = 0.0;  ///< magnitude, of the tip
    double inward_mm_per_s2 = 0.0;        ///< the same along the path
    double deflection_mm = 0.0;  ///< magnitude of what the structure bends; x is as uncertain as that
  };

  /// A contact begins.
  void begin() noexcept;
  /// One tick in contact.
  void update(const Observation& now, const TickInterval& interval) noexcept;
  /// One tick out of contact: the acceleration is remembered, and how the reading of a free tool varies.
  /// `noise_n`: what it differs by from its mean of late.
  void rest(double acceleration_mm_per_s2, double noise_n, const TickInterval& interval) noexcept;
  void reset() noexcept;
  /// Raises ε_f for a sensor that is noisier than a usual one, by so much.
  void set_excess_noise(double noise_n) noexcept { noise_n_ = noise_n; }

  /// Share of the desired force that may be rendered, 0 … 1.
  double authority() const noexcept {
    return parameters_.required ? std::max(earned_, sloped_) * support_ : 1.0;
  }
  /// Authority without the slope, for what is added past max_force_n().
  double earned_authority() const noexcept { return parameters_.required ? earned_ * support_ : 1.0; }
  /// What may be rendered at most: kSlopeForceN on the slope alone, growing without bound as all is earned.
  double max_force_n() const noexcept {
    return parameters_.required && earned_ < 1.0 ? kSlopeForceN / (1.0 - earned_)
                                                 : std::numeric_limits<double>::infinity();
  }
  /// Standard deviation of what a free tool reads on this rig, as far as it was seen.
  double noise_n() const noexcept { return std::clamp(std::sqrt(variance_n2_), kMinNoiseN, kMaxNoiseN); }
  /// What a sensor may read in free air at most, whatever the hand does.
  double max_free_force_n() const noexcept {
    return parameters_.unexplained_force_n + inertial_force_n(tool_mass_g_, kUnseenMmPerS2);
  }
  /// False once nothing resists any more: the contact is to be ended.
  bool plausible() const noexcept { return plausible_ || !parameters_.required; }
  /// True if it had been one: it has ended. False: it never was.
  bool proven() const noexcept { return std::max(earned_, sloped_) > 0.0; }

 private:
  static constexpr double kSlopeForceN = 0.25;  // below what free air may ever have
  static constexpr double kGrownN = 0.015;      // in each of both fits
  static constexpr double kMinNoiseN = 0.001;
  static constexpr double kMaxNoiseN = 0.02;
  static constexpr double kNoiseS = 0.5;
  static constexpr double kSustainedS = 0.010;  // filter and window of the acceleration
  static constexpr double kUnseenMmPerS2 = 25e3;
  static constexpr double kAccelerationMemoryS = 0.05;
  static constexpr double kGrowS = 0.005;  // of a and of s from 0 to 1: no step
  static constexpr double kSecantS = 0.05;
  static constexpr double kLostShare = 0.15;
  static constexpr double kFullShare = 0.35;
  static constexpr double kLostS = 0.005;
  static constexpr double kFreePathMm = 0.5;  // what a slanted or rounded onset may hide
  static constexpr double kMinDepthMm = 0.1;  // encoder steps below it make no secant
  static constexpr std::size_t kSlots = 10;   // of a millisecond each, together kSustainedS

  void follow_acceleration(double acceleration_mm_per_s2, double s) noexcept;
  /// Least of `evidence_n` over kSustainedS; negative until it has lasted so long.
  double sustained_n(double evidence_n, double s) noexcept;
  void follow_support(const Observation& now, double s) noexcept;

  EvidenceParameters parameters_;
  double threshold_n_;
  double noise_n_ = 0.0;  ///< by which it is higher
  double tool_mass_g_;
  double acceleration_mm_per_s2_ = 0.0;  ///< A
  std::array<double, kSlots> min_n_{};   ///< a ring of minima, each over kSustainedS/kSlots
  std::size_t slot_ = 0;
  double slot_s_ = 0.0;  ///< so far in the present slot
  double earned_ = 0.0;
  double goal_ = 0.0;  ///< of earned_
  StiffnessFit slope_;
  bool goes_on_ = false;  ///< the second fit is under way
  bool is_sloped_ = false;
  double sloped_ = 0.0;        ///< share that the slope has earned
  double variance_n2_ = 9e-6;  ///< of a free tool's reading
  double support_ = 1.0;
  double secant_n_per_mm_ = 0.0;
  double lost_s_ = 0.0;
  bool plausible_ = true;
};

}  // namespace hapticd::rt
