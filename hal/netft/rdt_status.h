#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace hapticd::netft {

/// Usability of a record, from its status word.
struct RdtFitness {
  bool faulty = false;     ///< the measurement cannot be relied on
  bool saturated = false;  ///< a gage at its end of range, or an error of the converter
  bool warning = false;    ///< usable, but the box reports a condition
};

/// 0x80010000 (a condition of the box's threshold logic has latched) is a warning; all other bits except
/// saturation are faults, including undocumented bits and the summary bit alone.
RdtFitness judge_rdt_status(std::uint32_t status) noexcept;

/// A bit of the status word. From the manufacturer's table of system status codes.
struct RdtStatusBit {
  unsigned bit;
  std::string_view name;
  std::string_view remedy;
};

/// Describes the bits that are set, by name and with remedy, highest bit first; empty for 0.
std::vector<std::string> describe_rdt_status(std::uint32_t status);

}  // namespace hapticd::netft
