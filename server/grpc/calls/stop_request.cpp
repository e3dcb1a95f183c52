#include "server/grpc/calls/stop_request.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstdint>
#include <optional>

#include "server/text/utf8_text.h"

namespace hapticd::server {

namespace {

/// Reads the wire format itself: protobuf's parser returns nothing if one byte is wrong.
class Wire {
 public:
  explicit Wire(std::string_view bytes) : bytes_(bytes) {}

  bool done() const { return bytes_.empty(); }
  std::size_t left() const { return bytes_.size(); }
  std::optional<std::uint64_t> varint() {
    std::uint64_t value = 0;
    for (unsigned shift = 0; shift < 64 && !bytes_.empty(); shift += 7) {
      const auto byte = static_cast<std::uint8_t>(bytes_.front());
      bytes_.remove_prefix(1);
      value |= static_cast<std::uint64_t>(byte & 0x7FU) << shift;
      if (byte < 0x80) return value;
    }
    return std::nullopt;
  }
  /// Takes at most as many bytes as there are.
  std::string_view take(std::uint64_t wanted) {
    const std::string_view taken = bytes_.substr(0, std::min<std::uint64_t>(wanted, bytes_.size()));
    bytes_.remove_prefix(taken.size());
    return taken;
  }

 private:
  std::string_view bytes_;
};

std::string one_line(std::string text) {
  std::replace_if(
      text.begin(), text.end(), [](char c) { return static_cast<unsigned char>(c) < 0x20 || c == 0x7f; },
      ' ');
  return text;
}

/// Finds the reason (field 1, the last of several). False if the bytes are not a whole message.
bool find_reason(std::string_view bytes, std::string_view& reason) {
  constexpr std::uint64_t kReason = (1U << 3U) | 2U;
  Wire wire(bytes);
  while (!wire.done()) {
    const auto tag = wire.varint();
    if (!tag) return false;
    switch (*tag & 7U) {
      case 0:
        if (!wire.varint()) return false;
        break;
      case 1:
        if (wire.take(8).size() < 8) return false;
        break;
      case 2: {
        const auto length = wire.varint();
        if (!length) return false;
        const bool is_whole = *length <= wire.left();
        const std::string_view content = wire.take(*length);
        if (*tag == kReason) reason = content;
        if (!is_whole) return false;
        break;
      }
      case 5:
        if (wire.take(4).size() < 4) return false;
        break;
      default:
        return false;
    }
  }
  return true;
}

}  // namespace

StopReason read_stop_request(std::string_view bytes) {
  StopReason read;
  std::string_view reason;
  if (!find_reason(bytes, reason)) {
    read.repairs.push_back(fmt::format(
        "the request of {} bytes is no whole StopRequest: what could be read of it was taken", bytes.size()));
  }
  if (!is_utf8(reason)) {
    read.repairs.emplace_back("the reason is not UTF-8: U+FFFD stands for what is not");
  }
  if (reason.size() > kMaxStopReason) {
    read.repairs.push_back(
        fmt::format("the reason of {} bytes was cut to {}", reason.size(), kMaxStopReason));
    reason = reason.substr(0, 2 * kMaxStopReason);  // enough to choose from, however long it is
  }
  read.text = one_line(shortened(repaired_utf8(reason), kMaxStopReason));
  return read;
}

StopReason read_stop_request(const grpc::ByteBuffer& request) {
  std::vector<grpc::Slice> slices;
  if (!request.Dump(&slices).ok()) return {{}, {"the request could not be read"}};
  std::string bytes;
  for (const grpc::Slice& slice : slices) {
    bytes.append(reinterpret_cast<const char*>(slice.begin()), slice.size());
  }
  return read_stop_request(bytes);
}

}  // namespace hapticd::server
