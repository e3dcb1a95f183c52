#pragma once

#include <optional>
#include <string>
#include <vector>

#include "hal/sim/simulated_rig.h"

namespace hapticd::study {

/// What is done with the tool while the cause is at work.
enum class TrustMotion : unsigned char {
  kWaved,       ///< rests, is waved ±20 mm at 2.2 Hz, rests; nothing is near
  kAbrupt,      ///< rests and is moved abruptly: 400 mm/s, 20 m/s²; nothing is near
  kBoth,        ///< one after the other
  kPress,       ///< presses an object, which is then gone or elsewhere; then free air
  kPressOften,  ///< presses and lets go again and again, then is waved in free air
  kLeave,       ///< rests, presses for 8 s and leaves the object at about 1 mm/s; then presses once more
  kStroke,      ///< strokes an object over its edge and back
};

/// One thing that must not make the device push in free air.
struct TrustCause {
  std::string name;   ///< of the figures, e.g. "late_tick"
  std::string level;  ///< e.g. "5 ms"; empty if there is only one
  TrustMotion motion = TrustMotion::kWaved;
  double duration_s = 0.0;  ///< at least so long, where it takes time
  bool needs_object = false;
  /// The sensor is biased as soon as the object pushes so hard, and the scene loaded after that: in free air
  /// it reads a pull from then on.
  double biased_at_n = 0.0;
  bool in_test = false;  ///< part of the bounded property test
  /// Makes the rig so.
  void (*apply)(sim::SimulationConfig& rig, double value) = nullptr;
  double value = 0.0;

  std::string label() const { return level.empty() ? name : name + " " + level; }
};

/// All of them, grouped by name. Recorded tick intervals are among them where HAPTICD_RECORDINGS is set.
const std::vector<TrustCause>& trust_causes();

/// Path of a recorded sequence of ticks ("idle", "loaded"); none if there are no recordings.
std::optional<std::string> recorded_ticks(const std::string& name);

}  // namespace hapticd::study
