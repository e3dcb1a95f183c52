#pragma once

#include <string>
#include <string_view>

namespace hapticd::server {

/// The text with U+FFFD for every byte that is not part of well-formed UTF-8. Text from files and clients is
/// repaired by this before it goes into a message, since protobuf sends only UTF-8.
std::string repaired_utf8(std::string_view text);
bool is_utf8(std::string_view text);

/// A UTF-8 text cut to at most so many bytes (3 or more), between two characters; a text that was cut ends in
/// "…".
std::string shortened(std::string_view text, std::size_t max_bytes);

}  // namespace hapticd::server
