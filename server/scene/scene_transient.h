#pragma once

#include <string>

#include "rt/scene/scene_spec.h"
#include "server/text/toml_reader.h"

namespace hapticd::server {

/// Reads the section [transient] of a scene file: a material, or modes given one by one.
void read_transient(TomlTable& root, rt::SceneSpec& spec);
/// Text as it is read, a material as its mode; empty if there is none.
std::string transient_text(const rt::SceneSpec& spec);

}  // namespace hapticd::server
