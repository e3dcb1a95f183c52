#pragma once

#include <cstdint>

#include "hal/samples.h"

namespace hapticd::rt {

/// Force and torque that a sensor reads without a load, in its own frame.
struct SensorZero {
  hal::Vector3 force_n;
  hal::Vector3 torque_n_mm;
};

/// How far it has been followed since the bias of this serial number (hal::RigSample::bias_serial).
struct FollowedZero {
  SensorZero zero;
  std::uint32_t bias_serial = 0;
};

}  // namespace hapticd::rt
