#pragma once

#include <optional>
#include <string>
#include <vector>

#include "hal/rig.h"
#include "rt/scene/scene_spec.h"
#include "server/model/store/model_library.h"

namespace hapticd::server {

/// Warnings about a stored model in a scene: not converged, identified on another device or with another
/// sensor, not identified as deep as the target goes.
std::vector<std::string> cautions(const StoredModel& stored, const rt::SceneSpec& scene,
                                  const hal::RigInfo& rig);

/// The values that a scene takes from the rig's own models.
struct RigModelUse {
  std::vector<std::string> stored;   ///< hashes of the models that gave a value
  std::vector<std::string> remarks;  ///< each value and its source; which were not used and why
};

/// The present zero of the force sensor.
struct ZeroInForce {
  std::string identity;                   ///< equal only for the same zero; empty = unknown
  std::optional<hal::Vector3> gravity{};  ///< unit vector in the tool's frame at the bias; if known
};

/// Orientation of the sensor in the tool and its reading without load: from the model if that was found under
/// this zero, else from the tool's weight in its orientation at the bias.
rt::SensorMounting mounting_of(const rt::ToolModel& tool, const hal::Vector3& gravity_at_bias,
                               const ZeroInForce& zero);

/// Fills in values that an unresolved scene does not set and that were identified on the rig: tool.mass_g
/// with the centre of that mass (scenes of kind "explore"), structure.stiffness_n_per_mm, the controller's
/// gains and contact.threshold_n, each if it is zero. Values that were not identified stay zero, for
/// rt::resolve() to fill in. A tool model that was found under another zero gives no bias. The part of
/// gravity in the zero then follows from the tool's orientation at the bias.
RigModelUse use_rig_models(const RigModels& models, rt::SceneSpec& scene, const hal::RigInfo& rig,
                           const ZeroInForce& zero);

}  // namespace hapticd::server
