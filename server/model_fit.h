#pragma once

#include <string>
#include <vector>

#include "hal/rig.h"
#include "rt/scene/scene_spec.h"
#include "server/model_library.h"

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

/// Fills what an unresolved scene leaves to the rig with what was identified of it: tool.mass_g with the
/// centre of that mass (scenes that explore), structure.stiffness_n_per_mm, the controller's gains and
/// contact.threshold_n, each where it is zero. What nothing was identified for stays zero, for rt::resolve()
/// to fill.
RigModelUse use_rig_models(const RigModels& models, rt::SceneSpec& scene, const hal::RigInfo& rig);

}  // namespace hapticd::server
