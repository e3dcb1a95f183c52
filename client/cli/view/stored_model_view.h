#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "client/cli/terminal/terminal.h"
#include "hapticd/v1/model.pb.h"

namespace hapticd::cli {

/// The first 12 digits: the short name of a stored model.
std::string short_hash(const std::string& hash);
/// True if a word can be the beginning of a hash: 6 to 64 hexadecimal digits.
bool looks_like_hash(std::string_view word);

/// Lists stored models, one a line; one with all its data; two side by side.
std::vector<std::string> stored_model_list(const v1::ListStoredModelsResponse& models,
                                           const Terminal& terminal);
std::vector<std::string> stored_model_text(const v1::StoredModel& model, const Terminal& terminal);
std::vector<std::string> model_difference_text(const v1::DiffStoredModelsResponse& difference,
                                               const Terminal& terminal);

}  // namespace hapticd::cli
