#pragma once

#include <array>
#include <cstdint>
#include <variant>

#include "hal/rig.h"
#include "rt/contact/contact_detector.h"
#include "rt/contact/contact_onset.h"
#include "rt/contact/free_motion_residual.h"
#include "rt/control/back_drive_compensation.h"
#include "rt/control/force_controller.h"
#include "rt/deformation/creep_law.h"
#include "rt/deformation/fused_displacement.h"
#include "rt/deformation/hunt_crossley.h"
#include "rt/deformation/published_direction.h"
#include "rt/deformation/tracked_direction.h"
#include "rt/guard/hand_port_passivity.h"
#include "rt/model/models.h"
#include "rt/scene/pipeline.h"
#include "rt/scene/scene_spec.h"
#include "rt/signal/motion_estimator.h"
#include "rt/signal/structural_deflection.h"
#include "rt/signal/tool_load.h"
#include "rt/target/release_fade.h"
#include "rt/target/target_blend.h"

namespace hapticd::rt {

/// Stiffness modulation in any direction on an object of unknown shape (D§4): tool load in any orientation,
/// contact, friction, deformation direction, displacement, target force, controller. Each alternative of a
/// stage is composed in once; what the scene did not ask for is not there.
class ExplorePipeline final : public Pipeline {
 public:
  /// `model` must hold what the spec needs (see compose()).
  ExplorePipeline(const SceneSpec& resolved, const ObjectModel& model, const hal::RigInfo& rig);

  std::uint32_t channels() const noexcept override;
  hal::Vector3 evaluate(const hal::RigSample& sample, TickRecord& record) noexcept override;
  void applied(const hal::Vector3& force_n) noexcept override;
  void reset() noexcept override;
  void set_target(const TargetLaw& target, double ramp_s) noexcept override;

 private:
  /// What one tick measured, rig frame.
  struct Measured {
    hal::Vector3 tip_mm;   ///< deflection of the structure taken into account
    hal::Vector3 step_mm;  ///< since the last tick
    hal::Vector3 velocity_mm_per_s;
    hal::Vector3 acceleration_mm_per_s2;
    hal::Vector3 reaction_n;  ///< on the tool
  };

  Measured measure(const hal::RigSample& sample) noexcept;
  bool update_contact(const hal::RigSample& sample, const Measured& now) noexcept;
  void begin_contact(const Measured& now) noexcept;
  void update_displacement(const Measured& now, double normal_n, double rate_mm_per_s) noexcept;
  /// How deep a soft object may be pressed before its force is told from nothing.
  double unfelt_displacement_mm() const noexcept;
  LawEstimate law_estimate(double normal_n, double rate_mm_per_s) noexcept;
  hal::Vector3 desired_force(const Measured& now, bool in_contact, double normal_n,
                             double rate_mm_per_s) noexcept;
  void tell(const Measured& now, bool in_contact, double normal_n, double rate_mm_per_s,
            const hal::Vector3& desired_n, const hal::Vector3& command_n, TickRecord& record) const noexcept;
  const hal::Vector3& normal() const noexcept;
  const hal::Vector3& friction_n() const noexcept;

  ExploreParameters options_;
  double max_force_n_;
  double lead_s_;

  ToolLoad load_;
  std::array<MotionEstimator, 3> motion_;
  StructuralDeflection deflection_;
  bool has_tip_ = false;
  hal::Vector3 last_tip_mm_;

  ContactParameters contact_parameters_;
  FreeMotionResidual3 residual_;
  ContactDetector contact_;
  ContactOnset3 onset_;
  bool regained_ = false;  ///< the present contact was not seen to begin

  std::variant<TrackedDirection, PublishedDirection> direction_;
  /// (4.21): the particle that was touched, followed along the surface.
  struct Particle {
    hal::Vector3 contacted_mm;
  };
  /// (4.23): the force through its 60 Hz filter.
  struct Inverse {
    ButterworthLowPass filter;
  };
  std::variant<FusedDisplacement, Inverse, Particle> estimator_;
  std::variant<std::monostate, CreepLaw, HuntCrossleyParameters> law_;
  LawEstimate law_now_;
  hal::Vector3 normal_before_;    ///< last tick's
  double displacement_mm_ = 0.0;  ///< in contact: the estimate; after it: counted on along the last normal
  double release_share_ = 0.0;    ///< of the target that is still rendered after a release
  double release_step_;

  TargetBlend target_;
  hal::Vector3 desired_before_n_;  ///< last tick's, for the fade
  HandPortPassivity passivity_;
  std::array<ForceController, 3> controller_;
  BackDriveCompensation back_drive_;
  hal::Vector3 back_drive_n_;  ///< in the command besides what the controller wants
  hal::Vector3 last_encoder_mm_;
};

}  // namespace hapticd::rt
