#pragma once

#include <string>
#include <vector>

#include "hal/error.h"
#include "hal/samples.h"

namespace hapticd::study {

/// How a recorded quaternion (q0, q1, q2, q3) is to be read.
struct QuaternionReading {
  const char* name;
  bool scalar_first;
  bool turns_world_into_tool;  ///< otherwise tool coordinates into those of the room
};

/// The four readings there are.
const std::vector<QuaternionReading>& quaternion_readings();

/// A six-axis sensor in a hand-held baton with its tracked pose, as a rig's samples: mm, N, N·mm. Columns as
/// in six_axis_handover/taker.csv. Refuses an unreadable file and missing columns.
hal::Result<std::vector<hal::RigSample>> load_handover(const std::string& path,
                                                       const QuaternionReading& reading);

}  // namespace hapticd::study
