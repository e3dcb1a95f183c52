#include "hal/netft/rdt_record.h"

#include <bit>

namespace hapticd::netft {

namespace {

constexpr std::uint16_t kRequestHeader = 0x1234;

std::uint32_t big_endian(const std::uint8_t* bytes) noexcept {
  return (std::uint32_t{bytes[0]} << 24U) | (std::uint32_t{bytes[1]} << 16U) |
         (std::uint32_t{bytes[2]} << 8U) | std::uint32_t{bytes[3]};
}

std::int32_t big_endian_signed(const std::uint8_t* bytes) noexcept {
  return std::bit_cast<std::int32_t>(big_endian(bytes));
}

}  // namespace

std::size_t parse_rdt_datagram(std::span<const std::uint8_t> bytes,
                               std::span<RdtRecord, kRdtMostRecords> records) noexcept {
  const std::size_t count = bytes.size() / kRdtRecordBytes;
  if (bytes.size() % kRdtRecordBytes != 0 || count > kRdtMostRecords) return 0;
  for (std::size_t i = 0; i < count; ++i) {
    const std::uint8_t* at = bytes.data() + i * kRdtRecordBytes;
    RdtRecord& record = records[i];
    record.rdt_sequence = big_endian(at);
    record.ft_sequence = big_endian(at + 4);
    record.status = big_endian(at + 8);
    for (std::size_t axis = 0; axis < 3; ++axis) {
      record.force_counts[axis] = big_endian_signed(at + 12 + 4 * axis);
      record.torque_counts[axis] = big_endian_signed(at + 24 + 4 * axis);
    }
  }
  return count;
}

std::array<std::uint8_t, 8> rdt_request(RdtCommand command, std::uint32_t count) noexcept {
  const auto code = static_cast<std::uint16_t>(command);
  const auto byte = [](std::uint32_t value, unsigned shift) {
    return static_cast<std::uint8_t>((value >> shift) & 0xffU);
  };
  return {byte(kRequestHeader, 8), byte(kRequestHeader, 0), byte(code, 8),  byte(code, 0),
          byte(count, 24),         byte(count, 16),         byte(count, 8), byte(count, 0)};
}

}  // namespace hapticd::netft
