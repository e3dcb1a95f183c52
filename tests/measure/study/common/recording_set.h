#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "hal/replay/replay_rig.h"

namespace hapticd::study {

/// A recording and how it is shown to a scene.
struct RecordingEntry {
  std::string name;  ///< "silicone_indentation/cycle_3"
  std::string set;   ///< "silicone_indentation"
  replay::ReplayConfig config{};
};

/// The folder named by the environment variable HAPTICD_RECORDINGS; none when that is unset or no folder.
std::optional<std::filesystem::path> recordings_folder();
/// Why there are none, for a test that skips and a study that records a failure.
std::string no_recordings_reason();

/// Recordings of one set below `folder`, by name; empty if there are none.
std::vector<RecordingEntry> recordings_of(const std::filesystem::path& folder, const std::string& set);

}  // namespace hapticd::study
