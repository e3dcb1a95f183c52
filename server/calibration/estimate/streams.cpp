#include "server/calibration/estimate/streams.h"

#include <algorithm>
#include <cmath>

namespace hapticd::calibration {

hal::RigSample sample_of(const RigPose& pose) {
  hal::RigSample sample;
  sample.angles = pose.angles;
  sample.tip_position_mm = {pose.tip_mm.x(), pose.tip_mm.y(), pose.tip_mm.z()};
  sample.tip_orientation = {pose.orientation.w(), pose.orientation.x(), pose.orientation.y(),
                            pose.orientation.z()};
  return sample;
}

bool RigStream::add(const RigPose& pose) {
  double sum = pose.time_s + pose.tip_mm.sum() + pose.orientation.coeffs().sum();
  for (std::size_t i = 0; i < 3; ++i) sum += pose.angles.joint_rad[i] + pose.angles.gimbal_rad[i];
  if (!std::isfinite(sum)) return false;
  if (!poses_.empty() && !(pose.time_s > poses_.back().time_s)) return false;
  poses_.push_back(pose);
  return true;
}

std::optional<RigPose> RigStream::at(double time_s) const {
  if (poses_.size() < 2 || !(time_s >= begin_s()) || time_s > end_s()) return std::nullopt;
  const auto later = std::upper_bound(poses_.begin(), poses_.end() - 1, time_s,
                                      [](double t, const RigPose& pose) { return t < pose.time_s; });
  const RigPose& b = *later;
  const RigPose& a = *(later - 1);
  const double step_s = b.time_s - a.time_s;
  if (step_s > kMaxGapS || a.angles.known != b.angles.known) return std::nullopt;
  const double share = (time_s - a.time_s) / step_s;
  RigPose pose;
  pose.time_s = time_s;
  pose.tip_mm = a.tip_mm + share * (b.tip_mm - a.tip_mm);
  pose.orientation = a.orientation.slerp(share, b.orientation);
  pose.angles.known = a.angles.known;
  for (std::size_t i = 0; i < 3; ++i) {
    const auto between = [share](double from, double to) { return from + share * (to - from); };
    pose.angles.joint_rad[i] = between(a.angles.joint_rad[i], b.angles.joint_rad[i]);
    pose.angles.gimbal_rad[i] = between(a.angles.gimbal_rad[i], b.angles.gimbal_rad[i]);
  }
  return pose;
}

Eigen::Vector3d RigStream::gimbal_direction(double time_s) const {
  constexpr double kHalfS = 0.015;
  constexpr double kSlowRadPerS = 0.05;
  const auto before = at(time_s - kHalfS);
  const auto after = at(time_s + kHalfS);
  Eigen::Vector3d direction = Eigen::Vector3d::Zero();
  if (!before || !after) return direction;
  for (int i = 0; i < 3; ++i) {
    const auto axis = static_cast<std::size_t>(i);
    const double rate = (after->angles.gimbal_rad[axis] - before->angles.gimbal_rad[axis]) / (2.0 * kHalfS);
    direction[i] = std::tanh(rate / kSlowRadPerS);
  }
  return direction;
}

std::optional<double> RigStream::speed_mm_per_s(double time_s) const {
  constexpr double kHalfS = 0.01;
  const auto before = at(time_s - kHalfS);
  const auto after = at(time_s + kHalfS);
  if (!before || !after) return std::nullopt;
  return (after->tip_mm - before->tip_mm).norm() / (2.0 * kHalfS);
}

}  // namespace hapticd::calibration
