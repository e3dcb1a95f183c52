#pragma once

#include <string>
#include <vector>

#include "hal/rig.h"
#include "hal/samples.h"
#include "rt/model/models.h"
#include "rt/scene/scene_spec.h"

namespace hapticd::study {

/// One tick of a stroke: the truth, what the default pipeline hands to its stages, and what whole pipelines
/// make of it.
struct StrokeTick {
  // truth
  bool touches = false;
  double displacement_mm = 0.0;
  double sliding_mm_per_s = 0.0;
  hal::Vector3 true_normal;
  // the default pipeline
  bool in_contact = false;
  bool begins = false;  ///< contact was declared in this tick
  hal::Vector3 tip_mm, step_mm, velocity_mm_per_s, reaction_n;
  hal::Vector3 normal;
  double normal_n = 0.0;
  double rate_mm_per_s = 0.0;
  /// Displacement by each pipeline that watched; NaN if it saw no contact.
  std::vector<double> estimate_mm{};
};

/// A pipeline that watches and the model it gets.
struct Watching {
  rt::SceneSpec scene;
  const rt::ObjectModel* model = nullptr;
};

struct StrokeLog {
  std::vector<StrokeTick> ticks;
  std::size_t release = 0;  ///< after it the tip only leaves the object

  /// Pressing and stroking, not yet leaving.
  bool counts(std::size_t tick) const { return ticks[tick].touches && tick <= release; }
};

/// Strokes back and forth over 50 mm with the tool swaying by 10°, on the high-force device, nothing
/// rendered: those of the explore study. The first of `watching` is the default pipeline.
StrokeLog log_strokes(const std::string& object, const std::string& tip, double force_n,
                      double speed_mm_per_s, std::uint64_t seed, const std::vector<Watching>& watching);

/// Speed along the surface from which the tip counts as sliding.
inline constexpr double kSlidingMmPerS = 10.0;

}  // namespace hapticd::study
