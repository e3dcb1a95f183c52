#pragma once

#include "hal/rig.h"
#include "server/config/config.h"
#include "server/pose/device_frame.h"
#include "server/pose/tool_pose.h"
#include "server/scene/scene_host.h"

namespace hapticd::pose {

/// Facts of the loaded scene that poses need; null = none is loaded.
SceneFacts facts_of(const server::ResolvedScene* scene, const hal::DeviceInfo& device);

/// Frame of the configured device's own software.
DeviceFrame device_frame_of(const server::DaemonConfig& config);

}  // namespace hapticd::pose
