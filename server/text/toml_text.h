#pragma once

#include <string>
#include <string_view>

#include "hal/error.h"
#include "hal/samples.h"

namespace hapticd::server {

/// The text of a file, at most 1 MiB.
hal::Result<std::string> read_text_file(const std::string& path);

/// A string as TOML writes it, quoted and escaped.
std::string toml_quoted(std::string_view text);
/// The shortest text that reads back as the same number.
std::string toml_number(double value);
std::string toml_vector(const hal::Vector3& v);

}  // namespace hapticd::server
