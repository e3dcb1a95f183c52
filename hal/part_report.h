#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace hapticd::hal {

enum class PartState : std::uint8_t {
  kIdle,        ///< not engaged: nothing is open
  kConnecting,  ///< engaged, but no data yet, or none any more
  kReady,       ///< delivers
  kFaulty,      ///< delivers, but reports a fault; or could not be engaged
};

/// One count or reading of a driver.
struct PartFigure {
  std::string name;  ///< e.g. "sequence_gaps"
  double value = 0.0;
  std::string unit;  ///< "" for a count
};

/// Report of a part of the rig, for people and test rigs; made outside the tick.
struct PartReport {
  std::string part;    ///< "haptic device", "force sensor", "turntable"
  std::string driver;  ///< e.g. "netft"
  PartState state = PartState::kIdle;
  std::string connection;  ///< e.g. "udp 192.168.1.1:49152, 7000 Hz"; empty if there is none
  std::vector<std::string>
      findings;  ///< present warnings and faults, each with its remedy; empty if there are none
  std::vector<PartFigure> figures;
};

}  // namespace hapticd::hal
