#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "hal/error.h"
#include "server/calibration/estimate/arm_fit.h"
#include "server/calibration/estimate/coverage.h"
#include "server/calibration/model/arm_calibration.h"

namespace hapticd::server {

/// The predicted target error at one place.
struct TargetErrorPoint {
  Eigen::Vector3d position_mm = Eigen::Vector3d::Zero();  ///< tracker's frame
  Eigen::Matrix3d covariance_mm2 = Eigen::Matrix3d::Zero();
};

/// A calibration and all that was found with it, as it is kept. Never changed once it has its hash.
struct StoredCalibration {
  std::string hash;  ///< SHA-256 of calibration_text(), hexadecimal
  calibration::CalibrationKind kind = calibration::CalibrationKind::kKinematics;
  std::string created;  ///< UTC, ISO 8601
  std::string rig;
  calibration::ArmFit fit;  ///< of a tip calibration: poses, outliers and residual only
  std::optional<Eigen::Vector3d> tip_in_marker_mm{};
  Eigen::Matrix3d tip_covariance_mm2 = Eigen::Matrix3d::Zero();
  std::vector<TargetErrorPoint> target_error;
};

const char* name_of(calibration::CalibrationKind kind) noexcept;

/// Text in JSON, its keys in a fixed order and every number exact; without the hash.
std::string calibration_text(const StoredCalibration& calibration);
/// Reads it back, and gives it the hash of the text. An error names what is missing or no number.
hal::Result<StoredCalibration> read_calibration(const std::string& text);

}  // namespace hapticd::server
