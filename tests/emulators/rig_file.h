#pragma once

#include <string>

#include "hal/rig.h"
#include "tests/emulators/board/board_world.h"
#include "tests/emulators/netft/netft_box.h"
#include "tests/emulators/openhaptics/page.h"

namespace hapticd::emulators {

/// The peers that there are; null: that part is behind another one.
struct RigPeers {
  const NetFtBox* box = nullptr;      ///< the force sensor's
  const HdPage* page = nullptr;       ///< the device's
  const BoardWorld* board = nullptr;  ///< of whatever else
  std::string calibration_file{};     ///< of the sensor's gauges on the board
  double instrument_mm_per_v = 0.0;   ///< > 0: on the board
  hal::Vector3 shoulder_mm{};         ///< of the arm on the board
};

/// The rig file that takes hapticd to them, with what else it needs as a comment.
std::string rig_file(const RigPeers& peers, const hal::RigInfo& simulated);

/// The command that starts the daemon beside this program on a rig file, ready to be pasted. Its bare name,
/// if there is none.
std::string daemon_command(const RigPeers& peers, const std::string& rig_file);

}  // namespace hapticd::emulators
