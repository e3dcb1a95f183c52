#pragma once

#include <optional>

#include "hal/rig.h"
#include "rt/control/force_controller.h"
#include "rt/scene/pipeline.h"
#include "rt/scene/scene_spec.h"
#include "rt/scene/wall_surface.h"
#include "rt/signal/tick_interval.h"
#include "rt/target/target_blend.h"

namespace hapticd::rt {

/// A virtual object, the comparison stimulus of a real one: a wall (D§3.4), a ball (D§4.7) or a scanned
/// surface, elastic or of any other target law. No sensor, no object: position is all it needs. The
/// controller works along the normal, which turns slowly against its delay.
class WallPipeline final : public Pipeline {
 public:
  WallPipeline(const SceneSpec& resolved, const hal::RigInfo& rig);

  std::uint32_t channels() const noexcept override;
  PipelineOutput evaluate(const hal::RigSample& sample) noexcept override;
  void fill_record(TickRecord& record) const noexcept override;
  void applied(const hal::Vector3& force_n) noexcept override;
  void reset() noexcept override;
  void set_target(const TargetLaw& target, double ramp_s) noexcept override;

 private:
  /// True while the tip is within the wall, having been seen outside.
  bool in_contact() const noexcept {
    return reason_ == ContactReason::kAboveThreshold || reason_ == ContactReason::kHeld;
  }
  /// Notes the onset of a tip that came in between the last tick and this one: on a straight line.
  void note_onset(const hal::RigSample& sample, double inside_mm, double outside_mm) noexcept;

  WallSurface surface_;
  hal::Vector3 inward_;         ///< where the tip is
  double structural_n_per_mm_;  ///< where the tip is; 0 = device taken as rigid
  std::optional<StructuralModel> structural_field_;
  TargetBlend target_;
  TickTimer timer_;
  double depth_mm_ = 0.0;       ///< last tick's, of the encoders
  double rate_mm_per_s_ = 0.0;  ///< of the displacement, smoothed
  ForceController controller_;
  double displacement_mm_ = 0.0;  ///< 0 out of contact
  double desired_n_ = 0.0;
  double command_n_ = 0.0;  ///< the last one, before the guard
  ContactReason reason_ = ContactReason::kAwaitingFree;
  std::uint32_t contact_count_ = 0;
  OnsetInstant onset_{};
  std::int64_t position_ns_ = 0;  ///< of the last tick's encoders
};

}  // namespace hapticd::rt
