#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <string_view>

#include "hal/error.h"

namespace hapticd::server {

using Json = nlohmann::json;  // objects sorted by key

/// JSON without blanks, keys sorted, numbers the shortest that read back as the same, -0 as 0. Throws
/// Json::exception if a text is not UTF-8.
std::string canonical_text(const Json& json);
/// Parses JSON; an error also if it is nested deeper than any model or holds more values. `where` names it in
/// errors.
hal::Result<Json> parse_json(std::string_view text, const std::string& where);
/// Error of a text that should be a model.
hal::Error not_a_model(hal::ErrorCode code, const std::string& what, const std::string& where,
                       const std::string& value = {}, const std::string& limit = {});
/// SHA-256, 64 hexadecimal digits in lower case.
std::string sha256_hex(std::string_view bytes);

}  // namespace hapticd::server
