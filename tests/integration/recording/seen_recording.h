#pragma once

#include <algorithm>
#include <cmath>
#include <map>
#include <string>
#include <vector>

#include "hal/recording/recording_file.h"
#include "tests/support/value_of.h"

namespace hapticd::test {

/// Contents of the file of a recording or an incident.
struct SeenRecording {
  std::vector<std::int64_t> ticks;
  std::vector<recording::Event> events;
  std::map<std::string, recording::Texts> metadata;
  bool is_finished = false;
  double greatest_force_n = 0.0;  ///< along z

  std::int64_t missing_ticks() const {
    return ticks.back() - ticks.front() + 1 - static_cast<std::int64_t>(ticks.size());
  }
  bool has_event(recording::EventKind kind, const std::string& words) const {
    return std::any_of(events.begin(), events.end(), [&](const recording::Event& event) {
      return event.kind == kind && event.text.find(words) != std::string::npos;
    });
  }
};

inline SeenRecording seen_of(const std::string& path) {
  SeenRecording seen;
  const auto file = value_of(recording::RecordingFile::open(path));
  const auto& columns = file.columns();
  const auto force = std::find_if(columns.begin(), columns.end(), [](const recording::Column& column) {
    return column.name == "sample_sensor_force_z_n";
  });
  recording::RecordingVisitor visitor;
  visitor.row = [&](const recording::Row& row) {
    seen.ticks.push_back(row.integer(0));
    const double force_n = row.number(static_cast<std::size_t>(force - columns.begin()));
    seen.greatest_force_n = std::max(seen.greatest_force_n, std::abs(force_n));
    return true;
  };
  visitor.event = [&](const recording::Event& event) { seen.events.push_back(event); };
  visitor.metadata = [&](const std::string& name, const recording::Texts& texts) {
    seen.metadata[name] = texts;
  };
  seen.is_finished = value_of(file.read(visitor)).is_finished;
  return seen;
}

}  // namespace hapticd::test
