#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "server/pose/rig_clock.h"
#include "server/pose/tool_pose.h"
#include "server/process/system_clock.h"

namespace hapticd::pose {

/// Relation of the daemon's clock to UTC; looked at once a second.
struct UtcRelation {
  std::int64_t utc_minus_monotonic_ns = 0;
  std::int64_t bound_ns = 0;  ///< ±; with the kernel's own if it is synchronized
  server::UtcKeeping keeping = server::UtcKeeping::kUnknown;
};

/// A pose, and the clocks it can be told by. Shared by all who want the same.
struct IssuedPose {
  PoseRequest request;
  ToolPose pose;
  RigClock clock;
  bool has_daemon_time = false;  ///< false if the rig has its own time
  UtcRelation utc;
  std::string
      encoded;  ///< for the network, by the first subscriber that needs it; the publisher's thread only
};

}  // namespace hapticd::pose
