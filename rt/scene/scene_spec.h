#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "hal/error.h"
#include "hal/rig.h"
#include "rt/contact/contact_detector.h"
#include "rt/control/force_controller.h"
#include "rt/guard/guard.h"

namespace hapticd::rt {

enum class SceneKind : std::uint8_t {
  kTap1d,  ///< stiffness modulation of a real object along one axis (D§3)
  kWall,   ///< an elastic virtual wall, no real object and no force sensor: the comparison stimulus of D§3.4
};

/// Everything that defines a scene, validated by compose(). The defaults are the dissertation's; values
/// that belong to the device (gains, structural stiffness, limits) default to those of the rig's device.
struct SceneSpec {
  std::string name;
  SceneKind kind = SceneKind::kTap1d;
  std::string description;
  std::string tip = "rod";  ///< what is mounted: "rod" (3 mm, round)
  std::string object_model =
      "none";  ///< 1D modulation needs no model of the object: measured force is enough

  hal::Vector3 press_axis{0.0, 0.0, -1.0};  ///< rig frame, into the object; normalised by compose()
  double tool_mass_g = 9.35;                ///< beyond the sensor (D§3.2.1)

  ContactParameters contact;
  double wall_position_mm = 0.0;  ///< kWall: the surface, along the press axis

  double target_stiffness_n_per_mm = 0.5;       ///< at load
  double max_target_stiffness_n_per_mm = 20.0;  ///< requests above are granted only this much
  double target_ramp_s = 0.1;                   ///< default ramp of a target change

  bool structural_compensation = true;
  double structural_stiffness_n_per_mm = 0.0;  ///< 0 = the device's own

  ControllerParameters controller;  ///< proportional_gain 0 = the device's own
  GuardLimits guard;                ///< zeros = the device's own
};

/// What the rig must offer for a scene, and what the scene is made of; for `scene explain`.
struct SceneOutline {
  std::vector<std::string> stages;    ///< in the order of the walk
  std::vector<std::string> hardware;  ///< "haptic device", "force sensor"
  std::vector<std::string> models;    ///< names of identified models needed; empty in 1D
  std::uint32_t channels = 0;         ///< bits of channel::
};

/// The spec with every default resolved against the rig's device, checked: unit press axis, gains inside the
/// stable region (`facts`: Kp > 0, |Kd'| < 1, Kp + 2 Kd' < 2), thresholds, limits no larger than the
/// device's.
hal::Result<SceneSpec> resolve(SceneSpec spec, const hal::RigInfo& rig);

/// Stages, hardware and channels of a resolved spec.
SceneOutline outline(const SceneSpec& spec);

}  // namespace hapticd::rt
