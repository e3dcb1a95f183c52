#pragma once

#include <cstdint>
#include <string>

#include "hal/rig.h"
#include "rt/scene/pipeline.h"
#include "rt/scene/scene_spec.h"

namespace hapticd::server {

/// How long a tick of a scene takes on this machine.
struct SceneCost {
  double median_ns = 0.0;
  double p999_ns = 0.0;
  std::uint32_t ticks = 0;  ///< measured ticks
  std::string remark;       ///< how it was measured
};

/// Drives `pipeline` (one of the caller's own, never the live one) through an approach, a press, a stroke and
/// a release made up of smooth synthetic samples, and times every tick, record included. Runs in the caller's
/// thread, for 20 ms at most.
SceneCost measure_cost(rt::Pipeline& pipeline, const rt::SceneSpec& resolved, const hal::RigInfo& rig);

}  // namespace hapticd::server
