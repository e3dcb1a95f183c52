#pragma once

#include <cstddef>
#include <string>
#include <vector>

namespace hapticd::study {

/// The true motion of the tool tip along one axis, as the simulator made it: one value each 0.1 ms.
struct MotionTrace {
  static constexpr std::size_t kStepsPerTick = 10;  ///< of a 1 kHz loop
  static constexpr double kRateHz = 1000.0;

  std::string name;
  std::vector<double> position_mm;
  std::vector<double> velocity_mm_per_s;       ///< central difference over ± 0.1 ms
  std::vector<double> acceleration_mm_per_s2;  ///< likewise

  std::size_t ticks() const { return position_mm.size() / kStepsPerTick; }
  /// Readings of an encoder of this step, one value a tick. It is taken to sit at the tip: what the bending
  /// structure hides cannot be held against an estimator.
  std::vector<double> encoder_mm(double step_mm) const;
};

enum class Vigour { kUsual, kGentle, kViolent };

/// Motions of a hand on the simulated PHANToM 1.0, `seconds` each: taps on a foam ball, strokes over a
/// sponge, waving in free air with the hand's tremor on it, the device shaking itself; and, last, a hand at
/// rest: held by the device's dry friction its tremor moves the tip by less than an encoder's step. Strokes
/// along the surface, all else along the vertical.
///
///             taps        strokes     waving              shaking
///   usual     400 mm/s    150 mm/s    30 mm/s, 0.7 Hz     1 N, 5 Hz
///   gentle    100 mm/s     40 mm/s    10 mm/s, 0.4 Hz     0.3 N, 3 Hz
///   violent  1000 mm/s    300 mm/s   200 mm/s, 2 Hz       3 N, 8 Hz
std::vector<MotionTrace> motion_traces(double seconds, Vigour vigour = Vigour::kUsual);

}  // namespace hapticd::study
