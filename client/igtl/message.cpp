#include "client/igtl/message.h"

#include <igtl_util.h>

#include <cstddef>

namespace hapticd::igtl_bridge {

namespace {

constexpr std::size_t kHeaderSize = 58;
constexpr std::size_t kBodySizePlace = 42;  ///< in the header; the checksum follows
constexpr std::size_t kExtendedSize = 12;
constexpr std::uint64_t kAscii = 3;  ///< as the registry of IANA numbers it

/// Big-endian, in `size` bytes.
void append_number(Packed& bytes, std::uint64_t number, std::size_t size) {
  for (std::size_t i = size; i-- > 0;) bytes.push_back(static_cast<std::uint8_t>(number >> (8 * i)));
}

void append(Packed& bytes, const auto& more) {
  bytes.insert(bytes.end(), more.begin(), more.end());
}

}  // namespace

Packed with_version_2(const Message& message, std::uint32_t number) {
  Packed sizes;
  Packed texts;
  append_number(sizes, message.metadata.size(), 2);
  for (const auto& [key, value] : message.metadata) {
    append_number(sizes, key.size(), 2);
    append_number(sizes, kAscii, 2);
    append_number(sizes, value.size(), 4);
    append(texts, key);
    append(texts, value);
  }
  Packed body;
  append_number(body, kExtendedSize, 2);
  append_number(body, sizes.size(), 2);
  append_number(body, texts.size(), 4);
  append_number(body, number, 4);
  body.insert(body.end(), message.packed.begin() + kHeaderSize, message.packed.end());
  append(body, sizes);
  append(body, texts);

  // The header is that of version 1 but for the version, the size of the body and its checksum.
  Packed bytes;
  append_number(bytes, 2, 2);
  bytes.insert(bytes.end(), message.packed.begin() + 2, message.packed.begin() + kBodySizePlace);
  append_number(bytes, body.size(), 8);
  append_number(bytes, crc64(body.data(), body.size(), 0), 8);
  append(bytes, body);
  return bytes;
}

}  // namespace hapticd::igtl_bridge
