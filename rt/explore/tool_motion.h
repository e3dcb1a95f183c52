#pragma once

#include <optional>

#include "hal/samples.h"
#include "rt/contact/contact_stage.h"
#include "rt/contact/zero_tracker.h"
#include "rt/contribution/contact_state.h"
#include "rt/model/structural_model.h"
#include "rt/signal/motion_estimator.h"
#include "rt/signal/structural_deflection.h"
#include "rt/signal/tool_load.h"

namespace hapticd::rt {

/// What the tool does and bears in a tick: motion of tip and mass, deflection of the structure, load without
/// weight, inertia and the sensor's zero, which is followed while the tool is free.
class ToolMotion {
 public:
  struct Parts {
    ToolLoad load;
    StructuralDeflection deflection;
    std::optional<StructuralModel> structural_field;  ///< none: as stiff everywhere
    bool mass_is_off_tip = false;                     ///< the mass moves otherwise than the tip
    double zero_bound_n = 0.0;
    double position_resolution_mm = 0.0;
    double rate_hz = 0.0;
  };
  explicit ToolMotion(const Parts& parts) noexcept;

  /// True if the sample came under another bias than the one before.
  bool take_bias(const hal::RigSample& sample) noexcept { return zero_.take_bias(sample.bias_serial); }
  /// Measures a tick. `device_n`: of the device on the tip since the last one.
  const ToolState& update(const hal::RigSample& sample, const hal::Vector3& device_n) noexcept;
  /// Follows the sensor's zero if a free tool shows it.
  void follow_zero(const hal::RigSample& sample, const ContactStage3& contact,
                   const TickInterval& interval) noexcept;
  void reset() noexcept;

  const ZeroTracker& zero() const noexcept { return zero_; }
  void adopt_zero(const FollowedZero& zero) noexcept { zero_.adopt(zero); }
  void biased_at(const hal::Quaternion& orientation) noexcept { load_.biased_at(orientation); }

 private:
  ToolLoad load_;
  ZeroTracker zero_;
  TickTimer timer_;
  ThreeAxisMotion motion_;
  std::optional<ThreeAxisMotion> mass_motion_;
  StructuralDeflection deflection_;
  std::optional<StructuralModel> structural_field_;
  bool has_tip_ = false;
  hal::Vector3 last_tip_mm_;
  hal::Vector3 last_encoder_mm_;
  ToolState state_;  ///< of the last tick
};

}  // namespace hapticd::rt
