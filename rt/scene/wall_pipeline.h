#pragma once

#include <optional>

#include "hal/rig.h"
#include "rt/control/force_controller.h"
#include "rt/scene/axis.h"
#include "rt/scene/pipeline.h"
#include "rt/scene/scene_spec.h"
#include "rt/target/target_ramp.h"

namespace hapticd::rt {

/// An elastic virtual wall, the comparison stimulus of D§3.4: no sensor, no object, position is all it needs.
class WallPipeline final : public Pipeline {
 public:
  WallPipeline(const SceneSpec& resolved, const hal::RigInfo& rig);

  std::uint32_t channels() const noexcept override;
  PipelineOutput evaluate(const hal::RigSample& sample, TickRecord& record) noexcept override;
  void applied(const hal::Vector3& force_n) noexcept override;
  void reset() noexcept override;
  void set_target(const TargetLaw& target, double ramp_s) noexcept override;

 private:
  PressAxis axis_;
  double wall_depth_mm_;
  double structural_n_per_mm_;  ///< where the tip is; 0 = device taken as rigid
  std::optional<StructuralModel> structural_field_;
  TargetRamp target_;
  ForceController controller_;
  ContactReason reason_ = ContactReason::kAwaitingFree;
  std::uint32_t contact_count_ = 0;
};

}  // namespace hapticd::rt
