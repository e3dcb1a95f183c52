#pragma once

#include <string>

#include "rt/scene/scene_spec.h"
#include "server/text/toml_reader.h"

namespace hapticd::server {

/// Section [transient] of a scene file: a material, or the modes of one's own.
void read_transient(TomlTable& root, rt::SceneSpec& spec);
/// As it is read, a material as its mode; empty where there is none.
std::string transient_text(const rt::SceneSpec& spec);

}  // namespace hapticd::server
