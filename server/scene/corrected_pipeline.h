#pragma once

#include <Eigen/Geometry>
#include <memory>

#include "rt/scene/pipeline.h"
#include "server/calibration/model/arm_calibration.h"

namespace hapticd::server {

/// A scene's stages on poses that a calibration corrected. Guard, assistance and telemetry go on with what
/// the device reports. A sample without angles is corrected as the one before it was, so that no pose jumps.
class CorrectedPipeline final : public rt::Pipeline {
 public:
  CorrectedPipeline(std::unique_ptr<rt::Pipeline> stages,
                    std::shared_ptr<const calibration::ArmCalibration> calibration)
      : stages_(std::move(stages)), calibration_(std::move(calibration)) {}

  std::uint32_t channels() const noexcept override { return stages_->channels(); }
  rt::PipelineOutput evaluate(const hal::RigSample& sample, rt::TickRecord& record) noexcept override;
  void applied(const hal::Vector3& force_n) noexcept override { stages_->applied(force_n); }
  void reset() noexcept override { stages_->reset(); }
  rt::FaultSet faults() const noexcept override { return stages_->faults(); }
  rt::FollowedZero zero() const noexcept override { return stages_->zero(); }
  void adopt_zero(const rt::FollowedZero& zero) noexcept override { stages_->adopt_zero(zero); }
  void distrust_sensor() noexcept override { stages_->distrust_sensor(); }
  void biased_at(const hal::Quaternion& orientation) noexcept override;
  void set_target(const rt::TargetLaw& target, double ramp_s) noexcept override {
    stages_->set_target(target, ramp_s);
  }

 private:
  std::unique_ptr<rt::Pipeline> stages_;
  std::shared_ptr<const calibration::ArmCalibration> calibration_;
  hal::Vector3 shift_mm_;  ///< of the last sample with angles
  Eigen::Quaterniond turn_ = Eigen::Quaterniond::Identity();
  bool is_known_ = false;  ///< since a sample had angles
  hal::Quaternion biased_at_;
  bool was_biased_ = false;
};

}  // namespace hapticd::server
