#pragma once

#include <optional>

#include "hal/rig.h"
#include "rt/record/tick_record.h"
#include "server/calibration/model/arm_calibration.h"
#include "server/pose/contact_follower.h"
#include "server/pose/device_frame.h"
#include "server/pose/motion_predictor.h"
#include "server/pose/tool_pose.h"

namespace hapticd::pose {

/// Makes poses of the loop's records. Follows all of them in their order; poses are made of the last one. One
/// thread.
class PoseMaker {
 public:
  explicit PoseMaker(const hal::DeviceInfo& device, const DeviceFrame& frame = {});

  void follow(const rt::TickRecord& record, const SceneFacts& scene) noexcept;
  bool begun() const noexcept { return begun_; }
  const rt::TickRecord& last() const noexcept { return last_; }
  /// Time at which the encoders of the last record were read, rig's clock.
  std::int64_t measured_ns() const noexcept { return last_.time_ns - last_.position_age_ns; }

  /// `calibration`: the adopted one, or null. The reference frame needs one that is registered; without it
  /// the pose is the rig's.
  ToolPose pose(const PoseRequest& request, const calibration::ArmCalibration* calibration) const;

 private:
  /// Standard deviation of the bending that is taken out, as a share: motors bend the structure later than
  /// asked, and its stiffness depends on the pose.
  static constexpr double kBendingError = 0.25;

  std::optional<Eigen::Vector3d> normal(const SceneFacts& scene) const noexcept;
  Eigen::Vector3d bending_mm() const noexcept;
  void fill_scene(ToolPose& pose) const;

  hal::DeviceInfo device_;
  DeviceFrame frame_;
  SceneFacts scene_;
  rt::TickRecord last_;
  bool begun_ = false;
  MotionPredictor motion_;
  ContactFollower contact_;
};

}  // namespace hapticd::pose
