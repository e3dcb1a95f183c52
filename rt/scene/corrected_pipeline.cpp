#include "rt/scene/corrected_pipeline.h"

#include <utility>

namespace hapticd::rt {

namespace {

Eigen::Quaterniond rotation(const hal::Quaternion& q) noexcept {
  return {q.w, q.x, q.y, q.z};
}

hal::Quaternion turned(const Eigen::Quaterniond& turn, const hal::Quaternion& orientation) noexcept {
  const Eigen::Quaterniond q = (turn * rotation(orientation)).normalized();
  return {q.w(), q.x(), q.y(), q.z()};
}

}  // namespace

PipelineOutput CorrectedPipeline::evaluate(const hal::RigSample& sample) noexcept {
  const CorrectedPose pose = correct(correction_, sample);
  if (pose.source != PoseSource::kReported && pose.tip_mm.allFinite() &&
      pose.orientation.coeffs().allFinite()) {
    const hal::Vector3 tip_mm{pose.tip_mm.x(), pose.tip_mm.y(), pose.tip_mm.z()};
    shift_mm_ = tip_mm - sample.tip_position_mm;
    turn_ = pose.orientation * rotation(sample.tip_orientation).conjugate();
    if (!std::exchange(is_known_, true) && was_biased_) biased_at(biased_at_);
  }
  hal::RigSample corrected = sample;
  corrected.tip_position_mm = sample.tip_position_mm + shift_mm_;
  corrected.tip_orientation = turned(turn_, sample.tip_orientation);
  return stages_->evaluate(corrected);
}

void CorrectedPipeline::biased_at(const hal::Quaternion& orientation) noexcept {
  biased_at_ = orientation;  // of a pipeline that has not seen a pose: said again when it has
  was_biased_ = true;
  stages_->biased_at(turned(turn_, orientation));
}

}  // namespace hapticd::rt
