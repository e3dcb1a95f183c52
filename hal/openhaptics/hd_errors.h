#pragma once

#include <array>
#include <cstdint>
#include <string_view>

#include "hal/openhaptics/hd_api.h"

namespace hapticd::openhaptics {

/// One error of the vendor's library: its public name, its effect on a sample, its remedy.
struct HdError {
  hd::ErrorCode code = 0;
  std::string_view name;
  std::uint32_t status = 0;  ///< bits of hal::sample_status
  std::string_view remedy;
};

inline constexpr std::size_t kHdErrorCount = 22;

/// All published errors; the last entry is used for any other code.
const std::array<HdError, kHdErrorCount>& hd_errors() noexcept;
/// Index in hd_errors(); never fails.
std::size_t hd_error_index(hd::ErrorCode code) noexcept;
inline const HdError& hd_error(hd::ErrorCode code) noexcept {
  return hd_errors()[hd_error_index(code)];
}

}  // namespace hapticd::openhaptics
