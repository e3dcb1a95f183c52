#pragma once

#include <string>
#include <string_view>

namespace hapticd::server {

/// The text with U+FFFD in the place of every byte that is no part of well-formed UTF-8. Text from files and
/// clients passes through here before it goes into a message: protobuf sends no other.
std::string repaired_utf8(std::string_view text);
bool is_utf8(std::string_view text);

/// At most so many bytes of a text (3 or more), cut between two characters; what was cut ends in "…". Expects
/// UTF-8.
std::string shortened(std::string_view text, std::size_t max_bytes);

}  // namespace hapticd::server
