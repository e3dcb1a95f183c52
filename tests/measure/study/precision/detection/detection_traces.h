#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

namespace hapticd::study {

/// What a detector of contact sees in a tick, along the press axis and positive into the object, and what it
/// cannot see.
struct DetectionTick {
  double force_n = 0.0;  ///< of the sensor, tool inertia included
  double depth_mm = 0.0;
  std::int64_t time_ns = 0;
  bool touches = false;  ///< the truth
};

/// A strike out of free flight: the bounces after it do not count.
struct Strike {
  std::size_t first_tick = 0;  ///< at which the tip is inside
  std::size_t last_tick = 0;   ///< of that contact, bounces included
  double began_ms = 0.0;       ///< true instant before `first_tick`, from depth and speed there; on the clock
};

struct TappedTrace {
  std::string object;
  double speed_mm_per_s = 0.0;
  std::vector<DetectionTick> ticks;
  std::vector<Strike> strikes;
};

/// Tool of the simulated PHANToM 1.0, beyond the sensor.
inline constexpr double kDetectionToolG = 9.35;

/// The free motion of D§3.2.2: the device shakes itself at 5 Hz and 1 N, nothing to touch.
std::vector<DetectionTick> shaken_trace(double seconds, std::uint64_t seed);
/// An object tapped from above, no force rendered.
TappedTrace tapped_trace(const std::string& object, double speed_mm_per_s, int taps, std::uint64_t seed);

}  // namespace hapticd::study
