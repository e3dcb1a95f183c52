#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "hal/error.h"
#include "rt/scene/scene_spec.h"

namespace hapticd::server {

/// Reads a scene from TOML text; what it does not say keeps SceneSpec's default. Unknown keys, wrong types
/// and values out of range are errors by name and line. `source` is what errors call the text, e.g. "scene
/// 'tap_1d'". The scene must carry its name unless `name` gives one; both given, they must agree.
hal::Result<rt::SceneSpec> parse_scene(std::string_view text, const std::string& source,
                                       const std::string& name = {});

/// The scene as TOML, every value written out; parse_scene() reads it back as the same.
std::string write_scene(const rt::SceneSpec& spec);

/// Names are file names too: 1 … 64 of a-z A-Z 0-9 _ -.
std::optional<hal::Error> check_scene_name(std::string_view name, std::string_view where);

}  // namespace hapticd::server
