#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "tests/measure/report/report.h"

namespace hapticd::bench {

/// Sink of a figure, with a line for the reader.
using AddFigure = std::function<void(const report::Figure&)>;

/// What one stream of poses received.
struct PoseTally {
  std::vector<double> age_ms;  ///< from the measurement to its arrival here, by the clock both share
  std::uint64_t skipped = 0;
};
/// Reads poses for so many seconds, `streams` at once, each over a separate connection.
PoseTally read_poses(const std::string& address, double rate_hz, double seconds, int streams);

/// `pose_age_ms` {rate_hz, quantile} of one subscriber, and of 16.
void add_pose_ages(const std::filesystem::path& logs, bool quick, const AddFigure& add);
/// `pose_cpu_share` {part}: what 16 subscribers at 120 Hz add to the daemon.
void add_pose_cpu(const std::filesystem::path& logs, bool quick, const AddFigure& add);
/// `contact_event_error_ms` {network, quantile}: the instant of a touch by the client's clock, against the
/// simulated truth.
void add_contact_events(const std::filesystem::path& logs, bool quick, const AddFigure& add);
/// `page_fps` of the visual page with the tumour scene, in headless Chromium.
void add_page_fps(const std::filesystem::path& logs, bool quick, const AddFigure& add);

}  // namespace hapticd::bench
