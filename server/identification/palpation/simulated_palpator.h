#pragma once

#include "hal/sim/hand/hand.h"
#include "server/identification/session/identification.h"

namespace hapticd::server {

/// Request as the simulated hand does it.
struct SimulatedMotion {
  sim::HandProgram program;
  double duration_s = 0.0;  ///< until it is surely over and the tip is free again
};

/// Motion of the hand for a request; the caller arranges what the device does meanwhile.
SimulatedMotion simulated_motion(const identification::MotionRequest& request);

}  // namespace hapticd::server
