#pragma once

#include "rt/guard/load_monitor.h"
#include "rt/scene/scene_spec.h"

namespace hapticd::rt {

/// Parameters of the guard's load watch for the tool of a scene. The rig's mass counts; if it knows none, the
/// scene's.
LoadMonitorParameters watched_tool(const SceneSpec& spec, const hal::RigInfo& rig) noexcept;

}  // namespace hapticd::rt
