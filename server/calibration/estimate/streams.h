#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cstddef>
#include <optional>
#include <vector>

#include "hal/samples.h"

namespace hapticd::calibration {

/// What the rig measured at one time of its clock.
struct RigPose {
  double time_s = 0.0;
  hal::DeviceAngles angles;
  Eigen::Vector3d tip_mm = Eigen::Vector3d::Zero();  ///< as reported, rig frame
  Eigen::Quaterniond orientation = Eigen::Quaterniond::Identity();
};

/// Pose as a sample, for functions that take samples.
hal::RigSample sample_of(const RigPose& pose);

/// What the tracker (or any visual system) measured: where its marker is, in its own frame.
struct ReferencePose {
  double stamp_s = 0.0;  ///< by the rig's clock, or one that runs as fast
  Eigen::Vector3d position_mm = Eigen::Vector3d::Zero();
  std::optional<Eigen::Quaterniond> orientation{};  ///< marker coordinates into the tracker's
};

/// Fewer are refused at once.
inline constexpr std::size_t kMinReferencePoses = 40;

/// The rig's poses in order of time, and between them.
class RigStream {
 public:
  /// False, and nothing kept, if the time does not go on or a number is none.
  bool add(const RigPose& pose);
  std::size_t size() const { return poses_.size(); }
  const std::vector<RigPose>& poses() const { return poses_; }
  double begin_s() const { return poses_.empty() ? 0.0 : poses_.front().time_s; }
  double end_s() const { return poses_.empty() ? 0.0 : poses_.back().time_s; }
  /// Angles and positions linearly, the orientation by the shortest turn. Nothing before the first pose,
  /// after the last, or in a gap of more than kMaxGapS.
  std::optional<RigPose> at(double time_s) const;
  /// Speed of the reported tip there, mm/s.
  std::optional<double> speed_mm_per_s(double time_s) const;
  /// Direction in which each gimbal angle moves there, -1 … 1: less than 1 in size below some degrees a
  /// second.
  Eigen::Vector3d gimbal_direction(double time_s) const;

  static constexpr double kMaxGapS = 0.02;

 private:
  std::vector<RigPose> poses_;
};

}  // namespace hapticd::calibration
