#pragma once

#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <string>

#include "hal/replay/recording.h"
#include "server/identification/session/identification.h"

namespace hapticd::identification::test {

/// A file of the real recordings; empty if they are not on this machine.
inline std::filesystem::path real_recording(const std::string& file) {
  const char* folder = std::getenv("HAPTICD_RECORDINGS");
  if (folder == nullptr || *folder == '\0') return {};
  const auto path = std::filesystem::path(folder) / file;
  return std::filesystem::exists(path) ? path : std::filesystem::path{};
}

/// Gives an identification a recording along one axis, row by row.
inline void play(Identification& identification, const replay::Recording& recording) {
  rt::Observation o;
  for (std::size_t i = 0; i < recording.time_s.size(); ++i) {
    o.sample.time_ns = std::llround(1e9 * recording.time_s[i]);
    o.sample.tip_position_mm.z = -recording.depth_mm[i];
    o.sample.sensor_force_n.z = recording.force_n[i];
    identification.add(o);
  }
}

}  // namespace hapticd::identification::test
