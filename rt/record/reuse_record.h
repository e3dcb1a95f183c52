#pragma once

#include <cstdint>

#include "rt/record/tick_record.h"

namespace hapticd::rt {

/// Makes a record that an earlier tick may have filled ready for a tick that fills all of these groups. Only
/// they keep what they have, if the scene is the same; everything else is as in a new record. The groups of
/// timing and truth are the loop's own.
inline void reuse(TickRecord& record, std::uint32_t channels, std::uint32_t scene_generation) noexcept {
  constexpr std::uint32_t kOfLoop = channel::kTiming | channel::kTruth;
  const bool has_others = (record.channels & ~(channels | kOfLoop)) != 0;
  if (has_others || record.scene_generation != scene_generation) [[unlikely]] {
    record = TickRecord{};
  }
  record.channels = channels;
  record.scene_generation = scene_generation;
}

}  // namespace hapticd::rt
