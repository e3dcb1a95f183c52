#pragma once

#include <array>
#include <cstddef>

#include "hal/samples.h"
#include "rt/identify/tool_excitation.h"

namespace hapticd::rt {

/// Sums of products of all that a ToolExcitation holds: whatever number of samples, the fit below sees no
/// more.
struct ToolMoments {
  static constexpr std::size_t kRegressors = 14;  ///< w, 1, time, B row by row
  static constexpr std::size_t kColumns = kRegressors + 6;

  std::array<double, kColumns*(kColumns + 1) / 2> products{};
  double samples = 0.0;
  double turning_square = 0.0;  ///< of |α|, rad²/s⁴

  /// `time_s`: any origin, the same for all; where it is always the same, nothing is said of a drift.
  void add(const ToolExcitation& e, double time_s = 0.0) noexcept;
  void add(const ToolMoments& other) noexcept;
};

/// Parameters of the tool's load with their standard errors (one sigma, before any correction for residuals
/// that resemble their neighbours); infinite where the motion does not determine them.
struct ToolLoadFit {
  bool good = false;
  double mass_g = 0.0;
  hal::Quaternion sensor_to_tool;
  hal::Vector3 force_bias_n, torque_bias_n_mm;                ///< at ToolLoadOptions::at_s
  hal::Vector3 force_drift_n_per_s, torque_drift_n_mm_per_s;  ///< of the biases, steady
  hal::Vector3 arm_mm;     ///< from the tip to the centre, r; zero where the tool hardly turned
  hal::Vector3 centre_mm;  ///< from the sensor's origin
  double mass_error_g = 0.0;
  hal::Vector3 rotation_error_rad, force_bias_error_n, torque_bias_error_n_mm, arm_error_mm, centre_error_mm;
  double force_rms_n = 0.0;  ///< of what is left, per component
  double torque_rms_n_mm = 0.0;
  double residual = 0.0;  ///< what is left over what force varies by
  bool has_torque = false;
};

struct ToolLoadOptions {
  double at_s = 0.0;        ///< when the biases are wanted: they drift
  bool turning = true;      ///< whether to look for the arm
  hal::Quaternion start{};  ///< where the search for sensor_to_tool starts, besides the data's own guess
};

/// Least squares over mass, rotation (proper), biases and how they drift, arm and centre; force and torque
/// weighed by what is left of each. Gauss-Newton with Levenberg's damping on the sums. Not good where sums
/// are not finite or empty.
ToolLoadFit fit_tool_load(const ToolMoments& moments, const ToolLoadOptions& options = {});

/// Mean square of what `fit` leaves of force [N²] and torque [N²·mm²] in other data, per component.
struct ToolLoadMisfit {
  double force_n2 = 0.0;
  double torque_n2_mm2 = 0.0;
};
/// `at_s`: as for the fit.
ToolLoadMisfit misfit(const ToolLoadFit& fit, const ToolMoments& moments, double at_s = 0.0);

}  // namespace hapticd::rt
