#pragma once

#include <Eigen/Geometry>
#include <memory>
#include <utility>

#include "rt/arm/corrected_pose.h"
#include "rt/scene/pipeline.h"

namespace hapticd::rt {

/// A scene's stages on poses that a calibration corrected. Guard, assistance and telemetry go on with what
/// the device reports. A sample without angles is corrected as the one before it was, so that no pose jumps.
class CorrectedPipeline final : public Pipeline {
 public:
  CorrectedPipeline(std::unique_ptr<Pipeline> stages, const ArmCorrection& correction) noexcept
      : stages_(std::move(stages)), correction_(correction) {}

  std::uint32_t channels() const noexcept override { return stages_->channels(); }
  PipelineOutput evaluate(const hal::RigSample& sample) noexcept override;
  void fill_record(TickRecord& record) const noexcept override { stages_->fill_record(record); }
  void applied(const hal::Vector3& force_n) noexcept override { stages_->applied(force_n); }
  void reset() noexcept override { stages_->reset(); }
  FaultSet faults() const noexcept override { return stages_->faults(); }
  FollowedZero zero() const noexcept override { return stages_->zero(); }
  void adopt_zero(const FollowedZero& zero) noexcept override { stages_->adopt_zero(zero); }
  void distrust_sensor() noexcept override { stages_->distrust_sensor(); }
  void biased_at(const hal::Quaternion& orientation) noexcept override;
  void set_target(const TargetLaw& target, double ramp_s) noexcept override {
    stages_->set_target(target, ramp_s);
  }

 private:
  std::unique_ptr<Pipeline> stages_;
  ArmCorrection correction_;
  hal::Vector3 shift_mm_;  ///< of the last sample with angles
  Eigen::Quaterniond turn_ = Eigen::Quaterniond::Identity();
  bool is_known_ = false;  ///< since a sample had angles
  hal::Quaternion biased_at_;
  bool was_biased_ = false;
};

}  // namespace hapticd::rt
