#pragma once

#include <string>
#include <string_view>

#include "hal/error.h"
#include "rt/model/identified_model.h"

namespace hapticd::server {

/// The canonical text of a model's content: JSON without blanks, keys sorted, numbers the shortest that read
/// back as the same (std::to_chars), -0 as 0, an infinite standard error as "Infinity". An error if a text is
/// not UTF-8 or too long, or if rt::check() refuses the model. Two models have the same text if and only if
/// they are the same.
hal::Result<std::string> canonical_json(const rt::IdentifiedModel& model);
/// Reads a canonical text back, strictly: all keys, no unknown ones, all values in range. `where` names it
/// in errors.
hal::Result<rt::IdentifiedModel> parse_canonical_json(std::string_view json, const std::string& where);
/// Parses a model whose hash must be `hash`.
hal::Result<rt::IdentifiedModel> parse_canonical_json(std::string_view json, const std::string& hash,
                                                      const std::string& where);

/// Exports a model to be carried elsewhere: JSON for people and programs, the content with its hash next to
/// it.
std::string export_json(std::string_view canonical, const std::string& hash);

struct ImportedModel {
  rt::IdentifiedModel model;
  std::string canonical;
  std::string hash;
};
/// Reads what export_json() wrote. Refused if it is not such a text, its schema is unknown, the content does
/// not fit the hash, or a value is out of range.
hal::Result<ImportedModel> import_json(std::string_view json);

}  // namespace hapticd::server
