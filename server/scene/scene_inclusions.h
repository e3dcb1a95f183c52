#pragma once

#include <string>

#include "rt/scene/scene_spec.h"
#include "server/text/toml_reader.h"

namespace hapticd::server {

/// Sections [[inclusion]] of a scene file; at most 8.
void read_inclusions(TomlTable& root, rt::SceneSpec& spec);
/// As they are read; empty where there are none.
std::string inclusions_text(const rt::SceneSpec& spec);

}  // namespace hapticd::server
