#pragma once

#include <cstdint>

namespace hapticd::rt {

/// Begin of a contact by the rig's clock, and the times between which it must have been. All 0 before the
/// first contact.
struct OnsetInstant {
  std::int64_t time_ns = 0;
  std::int64_t earliest_ns = 0;
  std::int64_t latest_ns = 0;
};

}  // namespace hapticd::rt
