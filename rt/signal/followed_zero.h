#pragma once

#include <cstdint>

#include "hal/samples.h"
#include "rt/signal/drift_tracker.h"

namespace hapticd::rt {

/// How far a sensor's zero has been followed since the bias of this serial number
/// (hal::RigSample::bias_serial).
struct FollowedZero {
  DriftTracker force;
  hal::Vector3 torque_n_mm;
  std::uint32_t bias_serial = 0;
};

}  // namespace hapticd::rt
