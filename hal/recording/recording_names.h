#pragma once

namespace hapticd::recording {

// What the parts of a recording are called in the file.

inline constexpr const char* kTelemetryTopic = "telemetry";
inline constexpr const char* kEventTopic = "events";
inline constexpr const char* kBlockSchema = "hapticd.v1.TelemetryBlock";
inline constexpr const char* kEventSchema = "hapticd.v1.RecordingEvent";

// Records of metadata.
inline constexpr const char* kStartMetadata = "recording";
inline constexpr const char* kSceneMetadata = "scene";
inline constexpr const char* kConfigurationMetadata = "configuration";
inline constexpr const char* kAnchorMetadata = "clock_anchor";
inline constexpr const char* kEndMetadata = "end";

}  // namespace hapticd::recording
