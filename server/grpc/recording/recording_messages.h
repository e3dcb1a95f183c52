#pragma once

#include <cstdint>
#include <string>

#include "hapticd/v1/recording.pb.h"
#include "server/recording/recording_info.h"
#include "server/session/outcome.h"

namespace hapticd::server {

void fill(const RecordingInfo& info, v1::RecordingKind kind, v1::RecordingFile& file);
/// Bits of rt::channel; 0 for no group. Refused: a group that does not exist.
Outcome<std::uint32_t> channels_of(const v1::StartRecordingRequest& request);
/// File of a message and all that it needs, as a FileDescriptorSet: what a reader of a recording needs.
std::string schema_of(const std::string& message);

}  // namespace hapticd::server
