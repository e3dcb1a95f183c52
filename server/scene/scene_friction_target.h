#pragma once

#include <string>

#include "rt/scene/scene_spec.h"
#include "server/text/toml_reader.h"

namespace hapticd::server {

/// Reads the section [friction_target] of a scene file.
void read_friction_target(TomlTable& root, rt::SceneSpec& spec);
/// Text as it is read; empty if there is none.
std::string friction_target_text(const rt::SceneSpec& spec);

}  // namespace hapticd::server
