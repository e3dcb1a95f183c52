#include "hal/recording/wire.h"

namespace hapticd::recording {

namespace {

constexpr std::uint32_t kVarint = 0;
constexpr std::uint32_t kFixed64 = 1;
constexpr std::uint32_t kLength = 2;
constexpr std::uint32_t kFixed32 = 5;

}  // namespace

void put_varint(std::uint64_t number, std::string& out) {
  while (number >= 0x80) {
    out += static_cast<char>(0x80U | (number & 0x7fU));
    number >>= 7U;
  }
  out += static_cast<char>(number);
}

void put_number_field(std::uint32_t field, std::uint64_t number, std::string& out) {
  if (number == 0) return;
  put_varint(field << 3U | kVarint, out);
  put_varint(number, out);
}

void put_bytes_field(std::uint32_t field, std::string_view bytes, std::string& out) {
  if (bytes.empty()) return;
  put_varint(field << 3U | kLength, out);
  put_varint(bytes.size(), out);
  out += bytes;
}

bool WireReader::take_varint(std::uint64_t& number) {
  number = 0;
  for (unsigned shift = 0; shift < 64; shift += 7) {
    if (rest_.empty()) return false;
    const auto byte = static_cast<unsigned char>(rest_.front());
    rest_.remove_prefix(1);
    number |= static_cast<std::uint64_t>(byte & 0x7fU) << shift;
    if ((byte & 0x80U) == 0) return true;
  }
  return false;
}

bool WireReader::next(WireField& field) {
  if (failed_ || rest_.empty()) return false;
  std::uint64_t key = 0;
  failed_ = true;
  if (!take_varint(key)) return false;
  field = {static_cast<std::uint32_t>(key >> 3U), 0, {}};
  std::uint64_t length = 0;
  switch (key & 7U) {
    case kVarint:
      if (!take_varint(field.value)) return false;
      break;
    case kFixed64:
      length = 8;
      break;
    case kFixed32:
      length = 4;
      break;
    case kLength:
      if (!take_varint(length)) return false;
      break;
    default:
      return false;
  }
  if (length > rest_.size()) return false;
  field.bytes = rest_.substr(0, length);
  rest_.remove_prefix(length);
  failed_ = false;
  return true;
}

}  // namespace hapticd::recording
