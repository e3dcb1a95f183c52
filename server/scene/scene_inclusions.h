#pragma once

#include <optional>
#include <string>
#include <vector>

#include "hal/rig.h"
#include "rt/scene/scene_spec.h"
#include "server/model/store/model_library.h"
#include "server/session/outcome.h"
#include "server/text/toml_reader.h"

namespace hapticd::server {

/// Sections [[inclusion]] of a scene file; at most 8.
void read_inclusions(TomlTable& root, rt::SceneSpec& spec);
/// Takes place and response of each inclusion that names an identified model from the store. `stored` gets
/// the hashes, `remarks` what was taken, and cautions. kNotFound if there is no such model.
std::optional<Refusal> fill_inclusions(const ModelLibrary& models, const hal::RigInfo& rig,
                                       rt::SceneSpec& spec, std::vector<std::string>& stored,
                                       std::vector<std::string>& remarks);
/// Text as they are read; empty if there are none.
std::string inclusions_text(const rt::SceneSpec& spec);

}  // namespace hapticd::server
