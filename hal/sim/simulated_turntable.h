#pragma once

#include <memory>

#include "hal/error.h"
#include "hal/turntable.h"
#include "hal/turntable/driven_turntable.h"

namespace hapticd::sim {

/// A table with a motor, a counter and a home switch, in real time.
struct SimulatedTurntableConfig {
  double start_deg = 25.0;  ///< angle at power-on, by the switch
  double homing_deg_per_s = 60.0;
  bool homed = false;  ///< as after a power cycle; true spares a demonstration the homing
};

hal::Result<std::unique_ptr<hal::Turntable>> create_turntable(const SimulatedTurntableConfig& config,
                                                              const turntable::TurntableSettings& settings);

}  // namespace hapticd::sim
