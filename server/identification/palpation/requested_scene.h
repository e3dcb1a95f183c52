#pragma once

#include <optional>

#include "hal/rig.h"
#include "rt/scene/scene_spec.h"
#include "server/identification/session/identification.h"

namespace hapticd::server {

/// Scene that renders what a request wants of the device, not resolved yet; none if it is to do nothing.
std::optional<rt::SceneSpec> requested_scene(const identification::MotionRequest& request,
                                             const hal::RigInfo& rig);

/// True if two scenes of requested_scene() make the device do the same.
bool renders_the_same(const rt::SceneSpec& a, const rt::SceneSpec& b);

}  // namespace hapticd::server
