#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <type_traits>

namespace hapticd::netft {

/// One measurement in the box's raw data transfer (RDT) protocol.
struct RdtRecord {
  std::uint32_t rdt_sequence = 0;  ///< position in the stream; wraps round
  std::uint32_t ft_sequence = 0;   ///< the box's own count of measurements; wraps round
  std::uint32_t status = 0;        ///< bits of rdt_status.h
  std::array<std::int32_t, 3>
      force_counts{};  ///< divided by the counts per force: in the box's unit of force
  std::array<std::int32_t, 3> torque_counts{};
};
static_assert(std::is_trivially_copyable_v<RdtRecord>);

inline constexpr std::size_t kRdtRecordBytes = 36;
/// Maximum number of records in a datagram, in buffered mode.
inline constexpr std::size_t kRdtMostRecords = 40;

/// Reads the records of a datagram and returns their number: one in real-time mode, up to kRdtMostRecords
/// in buffered mode. 0 when the length is not a whole number of records, or there are more than fit.
std::size_t parse_rdt_datagram(std::span<const std::uint8_t> bytes,
                               std::span<RdtRecord, kRdtMostRecords> records) noexcept;

enum class RdtCommand : std::uint16_t {
  kStop = 0x0000,
  kStartRealTime = 0x0002,
  kStartBuffered = 0x0003,
  kResetConditionLatch = 0x0041,
  kSetSoftwareBias = 0x0042,
};

/// Makes the eight bytes of a request. `count`: records wanted; 0 = until asked to stop.
std::array<std::uint8_t, 8> rdt_request(RdtCommand command, std::uint32_t count = 0) noexcept;

}  // namespace hapticd::netft
