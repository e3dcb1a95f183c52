#pragma once

#include <string>

#include "rt/scene/scene_spec.h"
#include "server/text/toml_reader.h"

namespace hapticd::server {

/// Section [friction_target] of a scene file.
void read_friction_target(TomlTable& root, rt::SceneSpec& spec);
/// As it is read; empty where there is none.
std::string friction_target_text(const rt::SceneSpec& spec);

}  // namespace hapticd::server
