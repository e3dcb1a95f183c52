#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace hapticd::netft {

/// What a status word means for the use of its record.
struct RdtFitness {
  bool faulty = false;     ///< the measurement cannot be relied on
  bool saturated = false;  ///< a gage at its end of range, or an error of the converter
  bool warning = false;    ///< fit for use, but the box wants something to be known
};

/// 0x80010000 (a condition of the box's threshold logic has latched) is a warning; everything but that and
/// the saturation is a fault, bits that are not documented and the summary bit alone included.
RdtFitness judge_rdt_status(std::uint32_t status) noexcept;

/// A bit of the status word. From the manufacturer's table of system status codes.
struct RdtStatusBit {
  unsigned bit;
  std::string_view name;
  std::string_view remedy;
};

/// What is set, by name and each with its remedy, highest bit first; empty for 0.
std::vector<std::string> describe_rdt_status(std::uint32_t status);

}  // namespace hapticd::netft
