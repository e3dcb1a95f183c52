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
  /// The newest fault that has passed, its age and its remedy, e.g. "HD_COMM_ERROR, 12 s ago: …". It is kept
  /// until the part is engaged again; empty if there was none.
  std::string last_fault{};
};

/// "12 s ago", "3 min ago".
inline std::string age_words(std::int64_t age_ns) {
  const std::int64_t age_s = age_ns / 1'000'000'000;
  return age_s < 120 ? std::to_string(age_s) + " s ago" : std::to_string(age_s / 60) + " min ago";
}

}  // namespace hapticd::hal
