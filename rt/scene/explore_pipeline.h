#pragma once

#include <cstdint>
#include <optional>

#include "hal/rig.h"
#include "rt/contribution/contribution.h"
#include "rt/control/back_drive_compensation.h"
#include "rt/control/command_end.h"
#include "rt/control/force_controller.h"
#include "rt/explore/explored_contact.h"
#include "rt/explore/stiffness_force.h"
#include "rt/explore/tool_motion.h"
#include "rt/model/models.h"
#include "rt/scene/pipeline.h"
#include "rt/scene/scene_spec.h"
#include "rt/target/contact_release.h"
#include "rt/target/device_reach.h"

namespace hapticd::rt {

/// Stiffness modulation in any direction on an object of unknown shape (D§4): motion and load of the tool,
/// contact and its geometry, the force of the target stiffness, what is added to it, controller. Each
/// alternative of a stage is composed in once; what the scene did not ask for is not there.
class ExplorePipeline final : public Pipeline {
 public:
  /// Composes the stages of a resolved scene. `model` must hold what the spec needs.
  ExplorePipeline(const SceneSpec& resolved, const ObjectModel& model, const hal::RigInfo& rig,
                  Contributions contributions);

  std::uint32_t channels() const noexcept override { return channels_; }
  PipelineOutput evaluate(const hal::RigSample& sample) noexcept override;
  void fill_record(TickRecord& record) const noexcept override;
  void applied(const hal::Vector3& force_n) noexcept override;
  void reset() noexcept override;
  void set_target(const TargetLaw& target, double ramp_s) noexcept override {
    stiffness_.set_target(target, ramp_s);
  }
  FaultSet faults() const noexcept override {
    const auto& stage = contact_.stage();
    return motion_.zero().faults(stage.waits_in_motion() || stage.is_too_noisy());
  }
  FollowedZero zero() const noexcept override { return motion_.zero().followed(); }
  void adopt_zero(const FollowedZero& zero) noexcept override { motion_.adopt_zero(zero); }
  void distrust_sensor() noexcept override { contact_.stage().distrust(); }
  void biased_at(const hal::Quaternion& orientation) noexcept override { motion_.biased_at(orientation); }

 private:
  /// Sum of the desired forces, bounded by the evidence of the contact.
  hal::Vector3 desired_force(const ContactState& now) noexcept;
  /// Holds the desired force into the object within what the sensor bears besides the hand; true if there was
  /// more.
  bool hold_within_sensor(const hal::Vector3& normal, hal::Vector3& desired_n) const noexcept;
  /// Command for the desired force. `compensated`: share of the device's friction that is, 0 … 1.
  hal::Vector3 command(const ContactState& now, const hal::Vector3& desired_n, double compensated) noexcept;

  DeviceReach reach_;
  ToolMotion motion_;
  ExploredContact contact_;
  ContactRelease release_;
  StiffnessForce stiffness_;
  Contributions contributions_;
  ThreeAxisController controller_;
  BackDriveCompensation3 back_drive_;
  CommandEnd3 end_;
  std::uint32_t channels_;
  std::optional<ContactState> now_;      ///< of the last tick
  double inward_n_ = 0.0;                ///< desired force into the object, of the last tick
  hal::Vector3 back_drive_direction_n_;  ///< all of the compensation
  hal::Vector3 past_controller_n_;       ///< in the command besides what the controller wants
  hal::Vector3 command_n_;               ///< the last one, before the guard
};

}  // namespace hapticd::rt
