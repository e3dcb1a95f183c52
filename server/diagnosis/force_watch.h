#pragma once

#include <cstdint>

#include "hal/samples.h"
#include "rt/record/tick_record.h"
#include "rt/scene/scene_spec.h"
#include "server/diagnosis/finding.h"

namespace hapticd::server {

/// What a while of ticks shows of the force sensor under a scene that uses it: whether it was biased, how far
/// its zero went, whether contacts are taken back, and, in one-dimensional scenes, whether its force follows
/// the press axis. A sensor whose axes are wrong shows no other sign than a scene that feels nothing.
class ForceWatch {
 public:
  static constexpr double kPressedN = 0.5;    ///< the tool counts as pressed beyond that
  static constexpr double kMaxOffDeg = 45.0;  ///< friction and a slanted surface stay below it

  explicit ForceWatch(const rt::SceneSpec& resolved);

  /// In the order of the ticks. Those of another scene than the last one's do not count.
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
