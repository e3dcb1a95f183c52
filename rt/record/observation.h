#pragma once

#include <type_traits>

#include "hal/samples.h"

namespace hapticd::rt {

/// All that was measured and commanded in one tick: what an identification listens to. From the live loop,
/// from a virtual run or from a file.
struct Observation {
  hal::RigSample sample;
  hal::Vector3 device_command_n;      ///< force sent to the device in answer to this sample, rig frame
  hal::Vector3 external_position_mm;  ///< of the tip by an instrument from outside, rig frame
  bool has_external_position = false;
};
static_assert(std::is_trivially_copyable_v<Observation>);

}  // namespace hapticd::rt
