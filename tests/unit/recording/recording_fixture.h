#pragma once

#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "hal/recording/recording_file.h"
#include "rt/loop/engine.h"
#include "server/config/recording_section.h"
#include "server/recording/event_log.h"
#include "server/recording/recording_sources.h"
#include "server/telemetry/telemetry_hub.h"
#include "tests/support/eventually.h"
#include "tests/support/still_rig.h"
#include "tests/support/temporary_folder.h"
#include "tests/support/value_of.h"

namespace hapticd::server {

/// Engine and hub driven by hand in a separate time, and what those who record need of the daemon.
class RecordingTest : public testing::Test {
 protected:
  explicit RecordingTest(std::size_t ring = 8192) : engine_(rig_, ring), hub_(engine_) {
    sources_.columns = kColumns;
    sources_.channels = rt::channel::kSample | rt::channel::kGuard;
    sources_.rate_hz = 100.0;
    sources_.block_schema = "schema";
    sources_.event_schema = "schema";
    sources_.rig = {{"rig", "still"}};
    sources_.configuration = "[loop]\n";
    sources_.scene = [] { return recording::Texts{{"name", "none"}}; };
    sources_.rig_time_ns = [this] { return engine_.last_time_ns(); };
    config_.folder = folder_.path("state");
    config_.keep_free_mb = 0.0;
  }

  /// Ticks of 10 ms; `pump`: those who record see them.
  void tick(std::uint64_t count, bool pump = true) {
    for (std::uint64_t i = 0; i < count; ++i) {
      hal::RigSample sample;
      sample.tick = next_tick_;
      sample.time_ns = static_cast<std::int64_t>(next_tick_) * 10'000'000;
      sample.force_count = 1;
      state_ = state_ * 6364136223846793005ULL + 1442695040888963407ULL;  // numbers that do not compress
      sample.sensor_force_n.z = 1e-9 * static_cast<double>(state_ >> 33U);
      ++next_tick_;
      engine_.on_tick(sample);
      if (pump && next_tick_ % 50 == 0) hub_.pump(Subscription::Clock::now());
    }
    if (pump) hub_.pump(Subscription::Clock::now());
  }

  struct Seen {
    std::vector<std::int64_t> ticks;
    std::vector<recording::Event> events;
    std::map<std::string, recording::Texts> metadata;
    recording::McapEnd end;
    std::vector<std::uint64_t> log_times_ns;
    double rows_s = 0.0;  ///< from the first to the last
    bool has(recording::EventKind kind) const {
      return std::any_of(events.begin(), events.end(), [&](const auto& event) { return event.kind == kind; });
    }
  };
  static Seen read_all(const std::string& path) {
    Seen seen;
    const auto file = test::value_of(recording::RecordingFile::open(path));
    recording::RecordingVisitor visitor;
    visitor.row = [&](const recording::Row& row) {
      seen.ticks.push_back(row.integer(0));
      return true;
    };
    visitor.event = [&](const recording::Event& event) { seen.events.push_back(event); };
    visitor.metadata = [&](const std::string& name, const recording::Texts& texts) {
      seen.metadata[name] = texts;
    };
    seen.end = test::value_of(file.read(visitor));
    if (!seen.ticks.empty()) seen.rows_s = 0.01 * static_cast<double>(seen.ticks.back() - seen.ticks.front());
    recording::McapVisitor raw;
    raw.message = [&](const recording::Message& message) {
      seen.log_times_ns.push_back(message.log_time_ns);
      return true;
    };
    static_cast<void>(test::value_of(test::value_of(recording::McapReader::open(path)).read(raw)));
    return seen;
  }
  /// Ticks that are missing between the first and the last.
  static std::int64_t missing(const std::vector<std::int64_t>& ticks) {
    return ticks.empty() ? 0 : ticks.back() - ticks.front() + 1 - static_cast<std::int64_t>(ticks.size());
  }

  static constexpr TelemetryColumn kColumns[] = {
      {"sample_sensor_force_z_n", "N", rt::channel::kSample,
       [](const rt::TickRecord& record) { return record.sensor_force_n.z; }},
      {"guard_authority", "1", rt::channel::kGuard,
       [](const rt::TickRecord& record) { return record.authority; }},
      {"truth_displacement_mm", "mm", rt::channel::kTruth,
       [](const rt::TickRecord& record) { return record.truth.displacement_mm; }}};

  const test::TemporaryFolder folder_;
  test::StillRig rig_;
  rt::Engine engine_;
  TelemetryHub hub_;
  EventLog event_log_;
  RecordingSources sources_;
  RecordingConfig config_;
  std::uint64_t next_tick_ = 0;
  std::uint64_t state_ = 1;
};

}  // namespace hapticd::server
