#pragma once

#include <cstdint>
#include <optional>

#include "hal/rig.h"
#include "rt/contact/contact_stage.h"
#include "rt/contact/path_check.h"
#include "rt/contact/pull_watch.h"
#include "rt/contact/zero_tracker.h"
#include "rt/control/back_drive_compensation.h"
#include "rt/control/command_end.h"
#include "rt/control/hand_port_passivity.h"
#include "rt/control/reaction_lead.h"
#include "rt/control/three_axis_controller.h"
#include "rt/deformation/direction.h"
#include "rt/deformation/displacement.h"
#include "rt/inclusion/rendered_inclusions.h"
#include "rt/model/models.h"
#include "rt/modulation/contact_transient.h"
#include "rt/modulation/friction_modulation.h"
#include "rt/modulation/late_onset.h"
#include "rt/scene/pipeline.h"
#include "rt/scene/scene_spec.h"
#include "rt/signal/structural_deflection.h"
#include "rt/signal/motion_estimator.h"
#include "rt/signal/tool_load.h"
#include "rt/target/feasible_range.h"
#include "rt/target/target_blend.h"

namespace hapticd::rt {

/// Stiffness modulation in any direction on an object of unknown shape (D§4): tool load in any orientation,
/// contact and its evidence, friction, deformation direction, displacement, target force, controller. Each
/// alternative of a stage is composed in once; what the scene did not ask for is not there.
class ExplorePipeline final : public Pipeline {
 public:
  /// Composes the stages of a resolved scene. `model` must hold what the spec needs.
  ExplorePipeline(const SceneSpec& resolved, const ObjectModel& model, const hal::RigInfo& rig);

  std::uint32_t channels() const noexcept override;
  PipelineOutput evaluate(const hal::RigSample& sample, TickRecord& record) noexcept override;
  void applied(const hal::Vector3& force_n) noexcept override;
  void reset() noexcept override;
  void set_target(const TargetLaw& target, double ramp_s) noexcept override;
  FaultSet faults() const noexcept override { return zero_.faults(contact_.waits_in_motion()); }
  FollowedZero zero() const noexcept override { return zero_.followed(); }
  void adopt_zero(const FollowedZero& zero) noexcept override { zero_.adopt(zero); }
  void distrust_sensor() noexcept override { contact_.distrust(); }
  void biased_at(const hal::Quaternion& orientation) noexcept override { load_.biased_at(orientation); }

 private:
  /// What one tick measured, rig frame.
  struct Measured {
    TickInterval interval;
    hal::Vector3 encoder_mm;
    hal::Vector3 tip_mm;   ///< deflection of the structure taken into account
    hal::Vector3 step_mm;  ///< since the last tick
    hal::Vector3 velocity_mm_per_s;
    hal::Vector3 acceleration_mm_per_s2;
    hal::Vector3 mass_mm;                      ///< centre of the tool's mass, by the encoders
    hal::Vector3 mass_acceleration_mm_per_s2;  ///< its acceleration
    hal::Vector3 load_n;                       ///< on the sensor, weight subtracted
    hal::Vector3 reaction_n;                   ///< on the tool
  };

  Measured measure(const hal::RigSample& sample) noexcept;
  void detect(const hal::RigSample& sample, const Measured& now) noexcept;
  /// True if the force reverses where the object was felt.
  bool is_pulled(const Measured& now, double reaction_n) noexcept;
  void begin_contact(const Measured& now) noexcept;
  /// Estimates direction and displacement of this tick; returns the normal force.
  double estimate(const Measured& now) noexcept;
  /// Ends a contact that nothing speaks for.
  void judge_contact(const Measured& now, double normal_n) noexcept;
  void follow_zero(const hal::RigSample& sample, const TickInterval& interval) noexcept;
  /// Speed into the object.
  double rate_mm_per_s(const Measured& now) const noexcept;
  /// Share that is rendered, 0 ... 1: in contact what its evidence allows, then what is left of the release.
  double authority() const noexcept;
  void follow_release(const TickInterval& interval) noexcept;
  hal::Vector3 desired_force(const Measured& now, bool in_contact, double normal_n) noexcept;
  /// Force that inclusions add, on the tip.
  hal::Vector3 inclusion_force(const Measured& now) noexcept;
  /// Force that a friction target adds, on the tip.
  hal::Vector3 friction_force(const Measured& now, double normal_n) noexcept;
  /// Force that a contact's transient adds, on the tip.
  hal::Vector3 transient_force(const Measured& now) noexcept;
  /// Holds the desired force within what the evidence of the contact allows so far.
  void hold_within_evidence(hal::Vector3& desired_n) noexcept;
  /// Holds the desired force into the object within what the sensor bears besides the hand; true if there was
  /// more.
  bool hold_within_sensor(hal::Vector3& desired_n) const noexcept;
  void fill_record(const Measured& now, bool in_contact, double normal_n, const hal::Vector3& desired_n,
                   TickRecord& record) const noexcept;

  ExploreParameters options_;
  DeviceReach reach_;
  double lead_s_;      ///< of the displacement, at least
  double lead_now_s_;  ///< and at the present target
  double delay_s_;     ///< of the loop

  ToolLoad load_;
  ZeroTracker zero_;
  TickTimer timer_;
  ThreeAxisMotion motion_;
  std::optional<ThreeAxisMotion> mass_motion_;  ///< where the mass moves otherwise than the tip
  StructuralDeflection deflection_;
  std::optional<StructuralModel> structural_field_;
  bool has_tip_ = false;
  hal::Vector3 last_tip_mm_;
  hal::Vector3 last_encoder_mm_;

  ContactParameters contact_parameters_;
  ContactStage3 contact_;
  PullWatch pull_;
  PathCheck path_check_;
  double path_mm_ = 0.0;  ///< into the object since the onset or the farthest retreat, along the normals
  std::uint32_t regain_ticks_;
  bool regained_ = false;  ///< the present contact was not seen to begin

  Direction direction_;
  Displacement displacement_;

  TargetBlend target_;
  std::optional<RenderedInclusions> inclusions_;
  std::optional<FrictionModulation> friction_;
  std::optional<ContactTransient> transient_;
  hal::Vector3 transient_n_;        ///< part of the command, not the controller's
  double release_share_ = 0.0;      ///< of what is still rendered after a release
  double release_authority_ = 0.0;  ///< in the last tick of contact
  double rendered_mm_ = 0.0;        ///< the displacement that is rendered; after a release it only shrinks
  hal::Vector3 desired_before_n_;   ///< in the last tick of contact, for the fade
  HandPortPassivity passivity_;
  ThreeAxisController controller_;
  LateOnset late_;
  CommandEnd3 end_;
  ReactionLead reaction_lead_;
  double reaction_ahead_n_ = 0.0;  ///< of the normal force, beyond its present value
  BackDriveCompensation3 back_drive_;
  hal::Vector3 back_drive_direction_n_;  ///< all of the compensation
  hal::Vector3 back_drive_n_;            ///< in the command besides what the controller wants
  hal::Vector3 command_n_;               ///< the last one, before the guard
};

}  // namespace hapticd::rt
