#pragma once

#include <cstdint>
#include <type_traits>

#include "hal/samples.h"
#include "rt/record/onset_instant.h"
#include "rt/record/fault.h"
#include "rt/signal/sensor_zero.h"

namespace hapticd::rt {

/// Groups of channels. A scene announces those it fills; the others do not exist in its telemetry.
namespace channel {
inline constexpr std::uint32_t kSample = 1U << 0;       ///< sensor force, tip position, status
inline constexpr std::uint32_t kMotion = 1U << 1;       ///< velocity, acceleration along the axis
inline constexpr std::uint32_t kContact = 1U << 2;      ///< contact state, reaction force
inline constexpr std::uint32_t kDeformation = 1U << 3;  ///< displacement
inline constexpr std::uint32_t kTarget = 1U << 4;       ///< target stiffness, desired device force
inline constexpr std::uint32_t kControl = 1U << 5;  ///< commanded force, estimated hand force, feasible range
inline constexpr std::uint32_t kGuard = 1U << 6;    ///< what the guard did
inline constexpr std::uint32_t kTiming = 1U << 7;   ///< wake-up, compute, device time, overruns
inline constexpr std::uint32_t kTruth = 1U << 8;    ///< only on a simulated rig
inline constexpr std::uint32_t kDirection = 1U << 9;   ///< normal, reaction and friction as vectors
inline constexpr std::uint32_t kFusion = 1U << 10;     ///< what the contact law says, and the deviation
inline constexpr std::uint32_t kPassivity = 1U << 11;  ///< energy at the hand's port
inline constexpr std::uint32_t kZero = 1U << 12;       ///< the sensor's zero as it is followed
inline constexpr std::uint32_t kInclusion = 1U << 13;  ///< what inclusions add, and where the strongest is
inline constexpr std::uint32_t kFriction = 1U << 14;   ///< what a friction target adds, and its range
inline constexpr std::uint32_t kTransient = 1U << 15;  ///< the transient of a contact
inline constexpr std::uint32_t kAngles = 1U << 16;     ///< joints and gimbal, if the device reports them
inline constexpr std::uint32_t kAssist = 1U << 17;     ///< the guide, the fixture, the presentation
}  // namespace channel

/// Why the contact state is what it is.
enum class ContactReason : std::uint8_t {
  kAwaitingFree,    ///< started or resumed under load: contact is declared only after the tool was seen free
  kFree,            ///< reaction force within the threshold
  kAboveThreshold,  ///< declared this tick: |f_r| > ε_f
  kHeld,            ///< in contact, force above the release level
  kBelowRelease,    ///< released this tick: force stayed below the release level
  kAboveSurface,    ///< released this tick: the tip drew back past the contact point or out of the wall
  kReactionLost,    ///< released this tick: the object that was touched is gone from under the tip
  kWithdrawn,       ///< what was declared was not an object; a contact follows only after the tool was seen
                    ///< free
};

/// State of the guard, the one gate between any renderer and any device.
enum class GuardState : std::uint8_t {
  kRendering,  ///< commands pass, bounded
  kResuming,   ///< after a clear: commands pass scaled by a rising authority
  kLatched,    ///< zero force, or falling to it, until someone clears
  kSuspended,  ///< the same until the fault is over by itself
};

namespace guard_limit {
inline constexpr std::uint8_t kForce = 1U << 0;  ///< magnitude was cut, or held within what the sensor bears
inline constexpr std::uint8_t kRate = 1U << 1;   ///< change since the last tick was cut
inline constexpr std::uint8_t kPower = 1U << 2;  ///< power into the user's hand was cut
inline constexpr std::uint8_t kPose = 1U << 3;   ///< with kForce: the device gives less than that in its pose
inline constexpr std::uint8_t kFreeAir = 1U << 4;  ///< the sensor bears no load, or it is not known whether
}  // namespace guard_limit

/// State of a motion on which the device leads the tool, or how it ended.
enum class GuideState : std::uint8_t {
  kNone,  ///< there was none yet
  kUnderWay,
  kArrived,   ///< within a millimetre of the goal
  kContact,   ///< an object was touched
  kResisted,  ///< the force was at its limit for half a second
  kTimedOut,
  kCancelled,
  kForceCut,  ///< the guard took the force away, or the tip was lost
};

/// What took the time when a period was overrun.
enum class OverrunCause : std::uint8_t { kNone, kWakeUp, kCompute, kDevice };

/// Times of one tick. Compute and device write time are those of the tick before: this one's are not over
/// yet.
struct TickTiming {
  std::int64_t wakeup_ns = 0;        ///< lateness of the wake-up; 0 if the rig owns the clock
  std::int64_t device_ns = 0;        ///< reading this tick's sample and writing the last tick's command
  std::int64_t compute_ns = 0;       ///< the last tick's computation
  std::uint32_t periods_missed = 0;  ///< periods skipped since the last tick
  OverrunCause overrun = OverrunCause::kNone;
};

/// All that is reported of one tick, fixed in size; the unit of telemetry. Scalars are along the scene's
/// press axis or, if a scene estimates it, along the deformation direction, positive into the object; forces
/// f_r, f_h, f_d as in (3.1): f_r = f_h + f_d.
struct TickRecord {
  std::uint64_t tick = 0;  ///< sequence number: a gap in it is a lost record
  std::int64_t time_ns = 0;
  std::uint32_t channels = 0;          ///< which groups below hold values
  std::uint32_t scene_generation = 0;  ///< counts scene loads; 0 = no scene

  // channel::kSample
  hal::Vector3 tip_position_mm;
  hal::Quaternion tip_orientation;
  hal::Vector3 angular_velocity_rad_per_s;  ///< rig frame; what reads the records fills it, not the tick
  hal::Vector3 sensor_force_n;
  hal::Vector3 sensor_torque_n_mm;  ///< tool frame, about the sensor's origin
  std::uint32_t sample_status = 0;
  std::uint32_t force_count = 0;
  std::int64_t force_age_ns = 0;  ///< of the newest sensor sample
  std::uint32_t bias_serial = 0;  ///< of the sensor's zero; 0 = never biased
  std::int64_t position_age_ns = 0;  ///< of the encoders' reading at time_ns
  // channel::kMotion
  double velocity_mm_per_s = 0.0;
  double acceleration_mm_per_s2 = 0.0;
  // channel::kContact
  double reaction_force_n = 0.0;  ///< f_r, tool inertia removed (3.4); in 3D its normal part
  bool in_contact = false;
  ContactReason contact_reason = ContactReason::kAwaitingFree;
  std::uint32_t contact_count = 0;    ///< contacts since the scene was loaded
  std::uint32_t withdrawn_count = 0;  ///< of those, how many turned out to be no object
  double contact_authority = 0.0;     ///< 0 … 1: share of the desired force the contact's evidence allows
  double contact_force_n = 0.0;       ///< magnitude of what the threshold is compared with
  OnsetInstant contact_onset;         ///< of the present contact, or the last
  // channel::kZero
  SensorZero zero;      ///< subtracted from what the sensor reads, its frame
  hal::Vector3 jump_n;  ///< that part of it which jumped, or was taken over otherwise (LoadMonitor)
  std::uint32_t jump_count = 0;  ///< jumps of the reading since the daemon started
  hal::Vector3 last_jump_n;      ///< the last of them, sensor frame
  // channel::kDeformation
  double displacement_mm = 0.0;  ///< x_r
  // channel::kTarget
  double target_stiffness_n_per_mm = 0.0;  ///< k~ in force this tick, while ramping between two targets
  double desired_force_n = 0.0;            ///< f~_d (3.3), positive into the object
  // channel::kControl
  double commanded_force_n = 0.0;      ///< f_c (3.6) along the axis, before the guard
  double hand_force_n = 0.0;           ///< f_h estimated as f_r - f_c(k-1) (3.1)
  double feasible_min_n_per_mm = 0.0;  ///< (3.8) at this hand force; 0 when out of contact
  double feasible_max_n_per_mm = 0.0;  ///< +inf if the device could hold the tip still
  // channel::kGuard
  hal::Vector3 device_command_n;  ///< what went to the device, rig frame
  GuardState guard_state = GuardState::kRendering;
  GuardFault guard_fault = GuardFault::kNone;  ///< why it is latched or suspended
  std::uint32_t faults_present = 0;            ///< this tick, warnings too: bit n is the fault of number n
  std::uint8_t guard_limits = 0;               ///< bits of guard_limit
  double authority = 1.0;                      ///< 0 … 1, rises after a clear
  // channel::kDirection, rig frame
  hal::Vector3 normal;            ///< u^n, out of the object; zero out of contact
  hal::Vector3 reaction_n;        ///< f_r on the tool (4.5)
  hal::Vector3 friction_force_n;  ///< f_r^t on the tool, estimated
  double sliding_mm_per_s = 0.0;  ///< speed across the normal
  // channel::kFusion
  double law_displacement_mm = 0.0;        ///< what the contact law alone makes of the force
  double displacement_deviation_mm = 0.0;  ///< standard deviation of displacement_mm
  // channel::kPassivity
  double hand_energy_mj = 0.0;                ///< taken from the hand since the contact began
  double passivity_damping_n_s_per_mm = 0.0;  ///< what the controller adds
  // channel::kInclusion, rig frame
  std::uint32_t inclusion = 0;         ///< number of the one that adds most
  hal::Vector3 inclusion_position_mm;  ///< of its centre: it moves (6.1)
  hal::Vector3 inclusion_force_n;      ///< on the tip, of all inclusions together
  // channel::kFriction
  double friction_scale = 1.0;         ///< of the real friction, after all bounds; 1 = as it is
  bool friction_is_bounded = false;    ///< the target asks for more or less
  hal::Vector3 friction_added_n;       ///< on the tip, rig frame
  double friction_feasible_min = 0.0;  ///< coefficients at the hand; 0 when out of contact
  double friction_feasible_max = 0.0;
  // channel::kTransient
  double transient_force_n = 0.0;          ///< in the command, positive out of the object
  double transient_impact_mm_per_s = 0.0;  ///< speed of the last impact
  double transient_share = 0.0;            ///< of the amplitude asked for, what the bounds left
  std::uint32_t transient_count = 0;       ///< since the scene was loaded
  // channel::kAngles
  hal::DeviceAngles angles;
  // channel::kAssist, rig frame
  hal::Vector3 guide_force_n;  ///< on the tip, wanted of the guard
  GuideState guide_state = GuideState::kNone;
  std::uint32_t guide_number = 0;         ///< counts motions from 1
  hal::Vector3 fixture_force_n;           ///< on the tip, wanted of the guard
  std::uint32_t presentation = 0;         ///< the one under way; 0 = none
  std::uint32_t presentation_broken = 0;  ///< bits of watch_bit, of it or the last one
  // channel::kTiming
  TickTiming timing;
  // channel::kTruth
  hal::TruthSample truth;
};
static_assert(std::is_trivially_copyable_v<TickRecord>);

}  // namespace hapticd::rt
