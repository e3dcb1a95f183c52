#pragma once

#include <string_view>

#include "hal/recording/block.h"
#include "server/recording/recording_sources.h"

namespace hapticd::server {

struct DaemonConfig;
class SceneHost;
class Session;

/// Kind of a call of the contract among the events of a recording.
recording::EventKind kind_of_call(std::string_view method);

/// Sources of what is recorded on this rig. `session` and `scenes` must outlive it.
RecordingSources sources_of(const DaemonConfig& config, const Session& session, const SceneHost& scenes);

}  // namespace hapticd::server
