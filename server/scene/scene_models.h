#pragma once

#include <optional>
#include <string>
#include <vector>

#include "hal/rig.h"
#include "rt/scene/scene_spec.h"
#include "server/model/store/model_library.h"

namespace hapticd::server {

/// What speaks for caution where a scene works with a stored model: not converged, identified on another
/// device or with another sensor, not known as deep as the target goes. In words.
std::vector<std::string> cautions(const StoredModel& stored, const rt::SceneSpec& scene,
                                  const hal::RigInfo& rig);

/// What a scene got from the rig's own models.
struct RigModelUse {
  std::vector<std::string> stored;   ///< hashes of those that gave a value
  std::vector<std::string> remarks;  ///< each value and where it comes from; what was not used and why
};

/// The zero that the force sensor is under.
struct ZeroInForce {
  std::string identity;                   ///< equal only for the same zero; empty = unknown
  std::optional<hal::Vector3> gravity{};  ///< unit vector in the tool's frame as it was biased; where known
};

/// How the sensor sits in the tool and what it reads of nothing: of the model where that was found under this
/// zero, else of the tool's weight as it hung when the sensor was biased.
rt::SensorMounting mounting_of(const rt::ToolModel& tool, const hal::Vector3& gravity_at_bias,
                               const ZeroInForce& zero);

/// Fills what an unresolved scene leaves to the rig with what was identified of it: tool.mass_g with the
/// centre of that mass (scenes that explore), structure.stiffness_n_per_mm, the controller's gains and
/// contact.threshold_n, each where it is zero. What nothing was identified for stays zero, for rt::resolve()
/// to fill.
/// A tool found under another zero gives no bias; what gravity the sensor takes for nothing is then known
/// from how the tool was held when it was biased.
RigModelUse use_rig_models(const RigModels& models, rt::SceneSpec& scene, const hal::RigInfo& rig,
                           const ZeroInForce& zero);

}  // namespace hapticd::server
