#pragma once

#include "hal/samples.h"

namespace hapticd::rt {

/// Force and torque that a sensor reads without a load, in its own frame.
struct SensorZero {
  hal::Vector3 force_n;
  hal::Vector3 torque_n_mm;
};

}  // namespace hapticd::rt
