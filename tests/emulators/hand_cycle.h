#pragma once

#include <string>
#include <vector>

#include "hal/sim/hand/hand.h"

namespace hapticd::emulators {

/// What the hand of an emulated rig is to do, again and again.
struct HandTask {
  std::string program = "press";  ///< one of hand_programs()
  double force_n = 2.0;
  double hold_s = 2.0;  ///< of a press; negative = for ever
};

/// "press", "tap", "rest", "wave", "dart", "follow", "survey" (for a calibration): a single motion.
/// "palpate", "rub", "turn", "free", "search", "walls": what a person does whom an identification of contact,
/// friction, tool, threshold, gains or structural stiffness asks.
std::vector<std::string> hand_programs();

/// Program of a single motion; at rest for the others.
sim::HandProgram single_motion(const HandTask& task);

/// One motion after the other. Empty for the programs of a single motion.
std::vector<sim::HandProgram> motions_in_turn(const HandTask& task);

}  // namespace hapticd::emulators
