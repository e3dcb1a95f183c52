#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "hal/error.h"
#include "hal/rig.h"
#include "rt/assist/assistance.h"
#include "rt/contact/contact_detector.h"
#include "rt/control/compensation_parameters.h"
#include "rt/control/force_controller.h"
#include "rt/friction/tip.h"
#include "rt/guard/guard.h"
#include "rt/inclusion/inclusion_parameters.h"
#include "rt/model/structural_model.h"
#include "rt/modulation/friction_target.h"
#include "rt/modulation/transient_parameters.h"
#include "rt/scene/wall_surface.h"
#include "rt/signal/tool_load.h"
#include "rt/target/target_law.h"

namespace hapticd::rt {

enum class SceneKind : std::uint8_t {
  kTap1d,  ///< stiffness modulation of a real object along one axis (D§3)
  kWall,   ///< an elastic virtual wall, no real object and no force sensor: the comparison stimulus of D§3.4
  kExplore,  ///< stiffness modulation in any direction: tapping, stroking, contour following (D§4)
};

enum class DirectionMethod : std::uint8_t { kTracked, kPublished };

enum class DisplacementEstimator : std::uint8_t {
  kFused,      ///< path of the tip and contact law, weighed by their variances
  kInverse,    ///< the contact law of the 60 Hz filtered force (4.23)
  kRecursive,  ///< the contacted particle followed along the surface (4.21); needs no model, drifts
};

enum class ContactLawKind : std::uint8_t { kCreep, kHuntCrossley };

/// What becomes of the real friction.
enum class FrictionFeel : std::uint8_t {
  kKept,       ///< the device adds a normal force only: friction stays as it is
  kCancelled,  ///< (4.4) as published: the hand feels k~ x along the normal and nothing else
};

/// What is rendered when an object that recovers slowly lets go of the tip while it is still deep.
enum class ReleaseMethod : std::uint8_t {
  kFollow,  ///< the target, at a displacement that only shrinks, fading over 12 ms
  kFade,    ///< the last force, fading over 12 ms
  kCut,     ///< nothing (D§4.3.1)
};

/// What only scenes of kind kExplore have.
struct ExploreParameters {
  DirectionMethod direction = DirectionMethod::kTracked;
  DisplacementEstimator displacement = DisplacementEstimator::kFused;
  ContactLawKind law = ContactLawKind::kCreep;
  FrictionFeel friction_feel = FrictionFeel::kKept;
  ReleaseMethod release = ReleaseMethod::kFollow;
  bool modulated = true;                         ///< false: the object stays as it is; only inclusions add
  bool passivity = true;                         ///< observer and controller at the hand's port
  double deflection_cutoff_hz = 10.0;            ///< how fast the tip is taken to follow (4.25)
  double force_noise_n = 0.003;                  ///< standard deviation of a tick's mean, each component
  hal::Vector3 gravity_at_bias{0.0, 0.0, -1.0};  ///< tool frame, when the sensor was biased (4.6)
  /// Identified bias and seat of the sensor; none if it was biased as above and sits straight.
  std::optional<SensorMounting> sensor_mounting{};
  /// Identified centre of the tool's mass from the tip, tool frame: as the tool turns its mass is carried
  /// round the tip. None: the mass moves as the tip does.
  std::optional<hal::Vector3> tip_to_centre_mm{};
};

/// Everything that defines a scene, validated by resolve(). The defaults are the dissertation's; values
/// that belong to the device (gains, structural stiffness, limits) default to those of the rig's device.
struct SceneSpec {
  std::string name;
  SceneKind kind = SceneKind::kTap1d;
  std::string description;
  Tip tip = Tip::kRod;
  /// Identified model of the object; "none" if the measured force is enough.
  std::string object_model = "none";
  /// Station at which the turntable must be for the scene to be loaded; empty if none is needed.
  std::string turntable_station{};
  /// The stages work on poses that the adopted calibration of the arm corrects. False: on the device's own.
  bool corrected_poses = false;

  hal::Vector3 press_axis{0.0, 0.0, -1.0};  ///< rig frame, into the object; normalised by resolve()
  double tool_mass_g = 9.35;  ///< beyond the sensor (D§3.2.1); kExplore: 0 = what the rig knows of it

  ContactParameters contact;
  double wall_position_mm = 0.0;  ///< kWall: the surface, along the press axis
  /// kWall: a ball in place of the plane.
  std::optional<BallParameters> wall_ball{};
  /// kWall: a scanned surface in place of both; pressed along −z.
  std::optional<SurfaceMapParameters> wall_map{};

  TargetLaw target;  ///< at load
  double max_target_stiffness_n_per_mm =
      0.0;                     ///< requests above are granted only this much; 0 = the device's
  double target_ramp_s = 0.1;  ///< default ramp of a target change
  /// How fast the force may change by a change of the target, in the tick: a pressing hand is not thrown off.
  double max_target_change_n_per_s = 5.0;

  bool structural_compensation = true;
  double structural_stiffness_n_per_mm = 0.0;  ///< 0 = the device's own
  /// Compliance over the workspace, about the one above at its centre: its stiffness at the tip's place
  /// replaces that.
  std::optional<StructuralModel> structural_field{};

  ExploreParameters explore;
  /// Stiff spheres that are not there, felt through the real object; kExplore. None: no such stage.
  std::vector<InclusionParameters> inclusions{};
  /// What the real friction is to feel like; kExplore with a rod. None: no such stage.
  std::optional<FrictionTarget> friction_target{};
  /// What a contact's first moments are to feel like; kExplore. None: no such stage.
  std::optional<TransientParameters> transient{};

  /// Walls that keep a press in its place. None: no such stage.
  std::optional<FixtureParameters> fixture{};
  /// What makes the presentation of a stimulus valid. None: no such stage.
  std::optional<WatchLimits> watch{};

  ControllerParameters controller;      ///< proportional_gain 0 = the device's own
  /// The identification of gains looks for where they oscillate; no scene text can ask for it.
  bool seeks_ultimate_gain = false;
  CompensationParameters compensation;  ///< kTap1d, kExplore
  GuardLimits guard;                    ///< zeros = the device's own
};

/// What the rig must offer for a scene, and what the scene is made of; for `scene explain`.
struct SceneOutline {
  std::vector<std::string> stages;    ///< in the order of the walk
  std::vector<std::string> hardware;  ///< "haptic device", "force sensor"
  std::vector<std::string> models;    ///< identified models needed, in words; empty in 1D
  std::uint32_t channels = 0;         ///< bits of channel::
};

/// Resolves every default of the spec against the rig's device, and checks it: unit press axis, gains inside
/// the stable region (`facts`: Kp > 0, |Kd'| < 1, Kp + 2 Kd' < 2), thresholds, limits no larger than the
/// device's.
hal::Result<SceneSpec> resolve(SceneSpec spec, const hal::RigInfo& rig);

/// Stiffness of the structure where it is softest: at the centre or a corner of what its field covers.
double softest_structure_n_per_mm(const SceneSpec& resolved) noexcept;

/// Assistance of a resolved spec: the part that is not the pipeline's.
AssistanceSpec assistance_of(const SceneSpec& resolved);

/// Stages, hardware and channels of a resolved spec.
SceneOutline outline(const SceneSpec& spec);

}  // namespace hapticd::rt
