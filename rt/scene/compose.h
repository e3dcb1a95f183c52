#pragma once

#include <memory>
#include <string>
#include <vector>

#include "hal/error.h"
#include "rt/model/models.h"
#include "rt/scene/pipeline.h"
#include "rt/scene/scene_spec.h"

namespace hapticd::rt {

/// Models that a resolved spec needs of the object, in words, e.g. "creep law of 'sponge_cut'"; empty if
/// measurement is enough. Those that `model` has are left out.
std::vector<std::string> needed_models(const SceneSpec& resolved, const ObjectModel* model = nullptr);

/// Builds exactly the stages a resolved spec needs. Fails if the rig or the object's model (null: there is
/// none) lack what the scene needs, by name.
hal::Result<std::unique_ptr<Pipeline>> compose(const SceneSpec& resolved, const hal::RigInfo& rig,
                                               const ObjectModel* model = nullptr);

}  // namespace hapticd::rt
