#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace hapticd::hal {

enum class PartState : std::uint8_t {
  kIdle,        ///< not engaged: nothing of it is open
  kConnecting,  ///< engaged, but nothing has come yet, or not any more
  kReady,       ///< delivers
  kFaulty,      ///< delivers, but says itself that it is unfit; or refuses to be engaged
};

/// One count or reading a driver keeps.
struct PartFigure {
  std::string name;  ///< e.g. "sequence_gaps"
  double value = 0.0;
  std::string unit;  ///< "" for a count
};

/// What a part of the rig says of itself, for people and test rigs; put together outside the tick.
struct PartReport {
  std::string part;    ///< "haptic device", "force sensor", "turntable"
  std::string driver;  ///< e.g. "netft"
  PartState state = PartState::kIdle;
  std::string connection;             ///< e.g. "udp 192.168.1.1:49152, 7000 Hz"; empty if there is none
  std::vector<std::string> findings;  ///< warnings and faults of now, each with its remedy; empty when well
  std::vector<PartFigure> figures;
};

}  // namespace hapticd::hal
