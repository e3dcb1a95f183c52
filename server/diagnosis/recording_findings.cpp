#include "server/diagnosis/recording_findings.h"

#include <fmt/format.h>

#include "server/recording/flight/flight_recorder.h"
#include "server/recording/recorder.h"

namespace hapticd::server {

namespace {

using enum FindingSeverity;

/// Share of the quota beyond which someone should make room.
constexpr double kNearlyFull = 0.9;

/// Finding of a part that is off: by configuration that is right; for a cause it is a problem.
Finding off(const char* topic, const Refusal& why) {
  const bool is_configured = why.error.code == hal::ErrorCode::kSwitchedOff;
  return {is_configured ? kNote : kProblem, topic, why.error.text(), why.error.remedy};
}

Finding kept_in(const char* topic, const RecordingFolder& folder) {
  const RecordingFolder::Limits& limits = folder.limits();
  const double used_mb = folder.used_mb();
  const std::string text =
      fmt::format("kept in {}: {:.1f} of {:g} MB", folder.path(), used_mb, limits.quota_mb);
  const bool ends_when_full = limits.when_full == WhenFull::kStop;
  if (!ends_when_full || used_mb < kNearlyFull * limits.quota_mb) return {kGood, topic, text, ""};
  return {kWarning, topic, text,
          fmt::format("delete some (hapticctl record delete), or raise {} or set when_full = "
                      "\"remove_oldest\"",
                      limits.quota_key)};
}

}  // namespace

Findings examine_recording(const Recorder& recorder, const FlightRecorder& flight) {
  const auto no_recordings = recorder.unavailable();
  const auto no_incidents = flight.unavailable();
  return {no_recordings ? off("recordings", *no_recordings) : kept_in("recordings", recorder.folder()),
          no_incidents ? off("incidents", *no_incidents) : kept_in("incidents", flight.folder())};
}

}  // namespace hapticd::server
