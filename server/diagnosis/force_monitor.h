#pragma once

#include <cstdint>

#include "hal/samples.h"
#include "rt/record/tick_record.h"
#include "rt/scene/scene_spec.h"
#include "server/diagnosis/finding.h"

namespace hapticd::server {

/// Judges the force sensor over some ticks of a scene that uses it: whether it was biased, how far its zero
/// drifted, whether contacts are withdrawn, and, in one-dimensional scenes, whether its force follows the
/// press axis. The only sign of a sensor with wrong axes is a scene without force.
class ForceMonitor {
 public:
  static constexpr double kPressedN = 0.5;    ///< the tool counts as pressed beyond that
  static constexpr double kMaxOffDeg = 45.0;  ///< friction and an inclined surface stay below it

  explicit ForceMonitor(const rt::SceneSpec& resolved);

  /// Adds a record, in the order of the ticks. A change of the scene starts over.
  void add(const rt::TickRecord& record);
  Findings findings() const;

 private:
  /// Fewer pressed ticks are an impact, not a press.
  static constexpr std::uint32_t kMinPressedTicks = 20;

  void add_pressed(const rt::TickRecord& record, const hal::Vector3& force_n);
  Finding of_press() const;
  void add_zero_findings(Findings& findings) const;

  bool one_dimensional_;
  hal::Vector3 press_axis_;  ///< rig frame, into the object
  double zero_bound_n_;
  std::uint32_t generation_ = 0;  ///< of the scene
  std::uint64_t ticks_ = 0;
  std::uint64_t usable_ticks_ = 0;
  rt::TickRecord last_;  ///< of the usable ones
  std::uint32_t pressed_ticks_ = 0;
  hal::Vector3 pressed_sum_n_;  ///< of the force on the tool while pressed
  double first_depth_mm_ = 0.0, deepest_mm_ = 0.0;
};

}  // namespace hapticd::server
