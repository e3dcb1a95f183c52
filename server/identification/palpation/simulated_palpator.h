#pragma once

#include "hal/sim/hand/hand.h"
#include "server/identification/session/identification.h"

namespace hapticd::server {

/// A request as the simulated hand does it.
struct SimulatedMotion {
  sim::HandProgram program;
  double duration_s = 0.0;  ///< until it is surely over and the tip is free again
};

/// What of a request concerns the hand; what the device is to do meanwhile is the caller's to arrange.
SimulatedMotion simulated_motion(const identification::MotionRequest& request);

}  // namespace hapticd::server
