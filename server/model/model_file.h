#pragma once

#include <string>
#include <string_view>

#include "hal/error.h"
#include "rt/model/models.h"

namespace hapticd::server {

/// Reads an object's model from TOML text. Each identified part is a section: [hunt_crossley], [creep],
/// [rod_friction], [bearing_friction]; other parts are left out. A section has all of its keys, except a
/// friction's `exponent` and `maxwell_slip = { reach_mm = […], stiffness_per_mm = […] }`, eight numbers each,
/// which replace Dahl's law. Unknown keys, wrong types and values out of
/// range are errors by name and line. `source` names the text in errors, e.g. a path. The model must
/// contain its name unless `name` gives one; if both are given they must agree.
hal::Result<rt::ObjectModel> parse_model(std::string_view text, const std::string& source,
                                         const std::string& name = {});

/// Writes the model as TOML; parse_model() reads it back bit for bit.
std::string write_model(const rt::ObjectModel& model);

}  // namespace hapticd::server
