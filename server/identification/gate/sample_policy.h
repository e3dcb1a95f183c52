#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>

#include "hal/rig.h"
#include "server/identification/gate/clip_monitor.h"

namespace hapticd::identification {

/// Time between two samples beyond which they are not consecutive, at any rate of the rig [s].
inline constexpr double kMaxSampleStepS = 0.016;

/// Time that what is derived from samples takes to settle after a start or a gap: velocities and filters.
inline constexpr double kPalpationSettlingS = 0.03;
inline constexpr double kThresholdSettlingS = 0.3;
inline constexpr double kToolSettlingS = 0.25;
inline constexpr double kImpactSettlingS = 0.15;  ///< gains: after touching, the impact rings

/// Reason for which a sample is not used.
enum class Unfit : std::uint8_t { kSaturated, kNoForce, kFault, kNotANumber, kStale, kDisordered };
inline constexpr std::size_t kUnfitKinds = 6;

/// Conditions that samples have to meet for one kind of identification. The defaults require nothing but a
/// position.
struct SamplePolicy {
  // What has to be a number, and how large it may be.
  bool press_axis_only = false;  ///< of force and position only z
  bool force = false;
  bool torque = false;
  bool orientation = false;
  bool command = false;
  double min_orientation_norm_squared = 0.0;
  double max_position_mm = std::numeric_limits<double>::infinity();
  double max_force_n = std::numeric_limits<double>::infinity();

  // What the rig reports.
  std::uint32_t status = 0;  ///< bits of hal::sample_status that make a sample unfit
  std::int64_t max_force_age_ns = std::numeric_limits<std::int64_t>::max();

  // The end of the sensor's range.
  double end_of_range_n = std::numeric_limits<double>::infinity();
  ClipPolicy clip;

  // Time.
  double max_step_s = kMaxSampleStepS;  ///< a longer one is a gap

  /// Order of the reasons: the first that applies is given.
  std::array<Unfit, 5> order{Unfit::kSaturated, Unfit::kNoForce, Unfit::kFault, Unfit::kNotANumber,
                             Unfit::kStale};
  /// A bit for each reason, 1 << Unfit, after which the next sample does not follow on the last one.
  std::uint32_t interrupting = 0;
};

/// Policy for presses along z, from a rig or a recording.
SamplePolicy palpation_policy(const hal::RigInfo& rig) noexcept;
/// Policy for presses all over an object: all three axes count.
SamplePolicy scan_policy(const hal::RigInfo& rig) noexcept;
/// Policy for strokes along x.
SamplePolicy stroke_policy(const hal::RigInfo& rig) noexcept;
/// Policy for a tool that is moved freely: mass, centre, bias.
SamplePolicy tool_policy(const hal::RigInfo& rig) noexcept;
/// Policy for a tool that is moved freely: what is left of the force.
SamplePolicy threshold_policy() noexcept;
/// Policy for presses at rising gain.
SamplePolicy gains_policy() noexcept;
/// Policy for presses of the device on walls or on a rigid object.
SamplePolicy structural_policy(const hal::RigInfo& rig, bool rigid_contact) noexcept;

}  // namespace hapticd::identification
