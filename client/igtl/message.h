#pragma once

#include <cstdint>
#include <string>
#include <utility>
#include <vector>

namespace hapticd::igtl_bridge {

/// A message of OpenIGTLink as it goes over the wire: header, body, checksum.
using Packed = std::vector<std::uint8_t>;

/// Pairs of a key and a value, in ASCII.
using Metadata = std::vector<std::pair<std::string, std::string>>;

/// A message that can be sent with either header version.
struct Message {
  Packed packed;      ///< with header version 1
  Metadata metadata;  ///< what only version 2 can say
};

/// The message with header version 2: the extended header comes before the content, the metadata behind it.
/// `number` counts the messages to one peer. Debian's library writes version 1 only.
Packed with_version_2(const Message& message, std::uint32_t number);

}  // namespace hapticd::igtl_bridge
