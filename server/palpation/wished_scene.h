#pragma once

#include <optional>

#include "hal/rig.h"
#include "rt/identify/identification.h"
#include "rt/scene/scene_spec.h"

namespace hapticd::server {

/// The scene that renders what a wish wants of the device, not resolved yet; none where it is to do nothing.
std::optional<rt::SceneSpec> wished_scene(const rt::Wish& wish, const hal::RigInfo& rig);

}  // namespace hapticd::server
