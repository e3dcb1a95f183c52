#pragma once

#include <string>

#include "rt/scene/scene_spec.h"
#include "server/text/toml_reader.h"

namespace hapticd::server {

/// Sections [fixture] and [watch] of a scene file.
void read_assistance(TomlTable& root, rt::SceneSpec& spec);
/// Text of the sections; empty without them.
std::string assistance_text(const rt::SceneSpec& spec);

}  // namespace hapticd::server
