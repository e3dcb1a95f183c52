#pragma once

#include <string>
#include <string_view>

#include "hal/error.h"
#include "rt/scene/scene_spec.h"

namespace hapticd::server {

/// Reads a scene from TOML text; keys that are absent keep SceneSpec's default. Unknown keys, wrong types,
/// values out of range, and keys that a scene of this kind does not use are errors by name and line. `source`
/// names the text in errors, e.g. "scene 'tap_1d'". The scene must contain its name unless `name` gives one;
/// if both are given they must agree.
hal::Result<rt::SceneSpec> parse_scene(std::string_view text, const std::string& source,
                                       const std::string& name = {});

/// Writes the scene as TOML, with every value of its kind; parse_scene() reads it back as the same.
std::string write_scene(const rt::SceneSpec& spec);

/// "linear", "hunt_crossley", …: the word of a scene file.
std::string_view word_of(rt::TargetLaw::Kind kind);
/// "rod" or "ball_bearing".
std::string_view word_of(rt::Tip tip);

}  // namespace hapticd::server
