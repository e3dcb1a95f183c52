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
  /// What an encoder of this step would read, one value a tick. It is taken to sit at the tip: what the
  /// bending structure hides is no estimator's fault.
  std::vector<double> encoder_mm(double step_mm) const;
};

/// Motions of a hand on the simulated PHANToM 1.0, `seconds` each: taps on a foam ball, strokes over a
/// sponge, slow waving with the hand's tremor on it, the device shaking itself at 5 Hz and 1 N; and, last, a
/// hand at rest: held by the device's dry friction its tremor moves the tip by less than an encoder's step.
/// Strokes along the surface, all else along the vertical.
std::vector<MotionTrace> motion_traces(double seconds);

}  // namespace hapticd::study
