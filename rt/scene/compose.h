#pragma once

#include <memory>

#include "hal/error.h"
#include "rt/scene/pipeline.h"
#include "rt/scene/scene_spec.h"

namespace hapticd::rt {

/// Builds exactly the stages a resolved spec needs. Fails where the rig lacks what the scene needs, by name.
hal::Result<std::unique_ptr<Pipeline>> compose(const SceneSpec& resolved, const hal::RigInfo& rig);

}  // namespace hapticd::rt
