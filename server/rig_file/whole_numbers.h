#pragma once

#include <fmt/ranges.h>

#include <string_view>

#include "server/text/toml_writer.h"

namespace hapticd::server {

// Describes a list of channels: numbers that are written without a fraction. An empty list is not written.

template <class Numbers, class... Limits>
void whole_numbers(TomlTable& table, std::string_view key, Numbers& numbers, const Limits&... limits) {
  table.read(key, numbers, limits...);
}
template <class Numbers, class... Limits>
void whole_numbers(TomlWriter& table, std::string_view key, const Numbers& numbers, const Limits&...) {
  if (!numbers.empty()) table.field(key, numbers);
}

}  // namespace hapticd::server
