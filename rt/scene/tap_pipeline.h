#pragma once

#include <cstdint>

#include "hal/rig.h"
#include "rt/contact/contact_stage.h"
#include "rt/contact/zero_tracker.h"
#include "rt/control/back_drive_compensation.h"
#include "rt/control/command_end.h"
#include "rt/control/force_controller.h"
#include "rt/control/reaction_lead.h"
#include "rt/control/swing_response.h"
#include "rt/modulation/late_onset.h"
#include "rt/scene/axis.h"
#include "rt/scene/pipeline.h"
#include "rt/scene/scene_spec.h"
#include "rt/signal/motion_estimator.h"
#include "rt/target/desired_force.h"
#include "rt/target/feasible_range.h"
#include "rt/target/release_fade.h"
#include "rt/target/soft_object_bound.h"
#include "rt/target/target_ramp.h"

namespace hapticd::rt {

/// Stiffness modulation along one axis (D§3): tool compensation, contact and its evidence, displacement from
/// the contact point, desired force, controller. Knows nothing of the object; the measured reaction is
/// enough.
class TapPipeline final : public Pipeline {
 public:
  TapPipeline(const SceneSpec& resolved, const hal::RigInfo& rig);

  std::uint32_t channels() const noexcept override;
  PipelineOutput evaluate(const hal::RigSample& sample) noexcept override;
  void fill_record(TickRecord& record) const noexcept override;
  void applied(const hal::Vector3& force_n) noexcept override;
  void reset() noexcept override;
  void set_target(const TargetLaw& target, double ramp_s) noexcept override;
  FaultSet faults() const noexcept override {
    return zero_.faults(contact_.waits_in_motion() || contact_.is_too_noisy()) |
           (swing_.keeps_structure() ? 0 : set_of(GuardFault::kStructureSwings));
  }
  FollowedZero zero() const noexcept override { return zero_.followed(); }
  void adopt_zero(const FollowedZero& zero) noexcept override { zero_.adopt(zero); }
  void distrust_sensor() noexcept override { contact_.distrust(); }

 private:
  /// What one tick measured along the axis.
  struct Measured {
    TickInterval interval;
    double depth_mm = 0.0;
    double sensor_n = 0.0;    ///< zero subtracted
    double reaction_n = 0.0;  ///< f_r (3.4)
    double step_mm = 0.0;     ///< motion of the encoders since the last tick; 0 if there is none
  };

  Measured measure(const hal::RigSample& sample) noexcept;
  void update_contact(const hal::RigSample& sample, const Measured& now) noexcept;
  /// Desired force by (3.3), with reaction and displacement as far ahead as the loop is late.
  DesiredForce desired_force(const Measured& now, double target_n_per_mm) noexcept;
  /// Bending of the structure beyond the controller's force, since the contact began: a hand that approaches
  /// drags the motors' friction along, whose compensation in contact takes that load off it again. Fades as
  /// that does.
  double friction_deflection_mm(double target_n_per_mm) const noexcept;
  void follow_zero(const hal::RigSample& sample, const TickInterval& interval) noexcept;
  /// Holds a target that is too soft for the sensor at what it measures, like one that is too soft for the
  /// device. True if it was held.
  bool hold_within_sensor(DesiredForce& desired, double encoder_mm) const noexcept;
  /// Desired force of `force_n`, with the displacement that goes with it.
  DesiredForce held_at(double force_n, double encoder_mm) const noexcept;

  PressAxis axis_;
  double tool_mass_g_;
  double structural_n_per_mm_;  ///< where the tip is; 0 = device taken as rigid
  std::optional<StructuralModel> structural_field_;
  DeviceReach reach_;
  bool is_held_ = false;  ///< this tick, see hold_within_sensor()
  TickTimer timer_;
  MotionEstimator motion_;
  ZeroTracker zero_;
  bool looks_back_;  ///< a contact began before it was declared
  ContactStage contact_;
  double contact_depth_mm_ = 0.0;  ///< where the present contact began
  TargetRamp target_;
  SoftObjectBound soft_object_;
  ForceController controller_;
  LateOnset late_;
  CommandEnd end_;
  ReleaseFade fade_;
  ReactionLead reaction_lead_;
  SwingResponse swing_;
  double displacement_lead_s_;
  BackDriveCompensation back_drive_;
  double onset_friction_n_ = 0.0;  ///< of the device, where the present contact began
  double last_depth_mm_ = 0.0;
  bool has_depth_ = false;
  double back_drive_n_ = 0.0;       ///< in the command besides what the controller wants
  double rendered_n_per_mm_ = 0.0;  ///< the target, within what the object allows
  double reaction_n_ = 0.0;         ///< f_r, of the last tick like those below
  double desired_n_ = 0.0;
  double displacement_mm_ = 0.0;
  double command_n_ = 0.0;  ///< the last one, before the guard
};

}  // namespace hapticd::rt
