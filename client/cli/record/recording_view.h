#pragma once

#include <string>
#include <vector>

#include "client/cli/terminal/terminal.h"
#include "hapticd/v1/recording.pb.h"

namespace hapticd::cli {

/// "3.2 MB".
std::string size_words(std::uint64_t bytes);
/// "2026-11-24 00:52:00 UTC".
std::string utc_text(std::int64_t unix_ns);
/// One line for people: "00012_20261124T005200Z_press: 10000 rows in 10.0 s, none lost, 3.2 MB".
std::string recording_line(const v1::RecordingFile& file);
std::vector<std::string> recording_table(const v1::ListRecordingsResponse& list, const Terminal& terminal);
std::vector<std::string> incident_table(const v1::ListRecordingsResponse& list, const Terminal& terminal);

}  // namespace hapticd::cli
