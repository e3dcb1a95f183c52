#pragma once

#include <array>
#include <cstddef>

#include "hal/samples.h"
#include "server/identification/estimate/tool_excitation.h"

namespace hapticd::identification {

/// Sums of products of all that a ToolExcitation holds: the fit below needs no more, whatever the number of
/// samples.
struct ToolMoments {
  static constexpr std::size_t kRegressors = 13;  ///< w, 1, B row by row
  static constexpr std::size_t kColumns = kRegressors + 6;

  std::array<double, kColumns*(kColumns + 1) / 2> products{};
  double samples = 0.0;
  double turning_square = 0.0;  ///< of |α|, rad²/s⁴

  void add(const ToolExcitation& e) noexcept;
  void add(const ToolMoments& other) noexcept;
  /// Moments about the means: a bias is lost, and with it the sensor's zero meanwhile.
  ToolMoments centred() const noexcept;
};

/// Parameters of the tool's load with their standard errors (one sigma, before any correction for residuals
/// that resemble their neighbours); infinite if the motion does not determine them.
struct ToolLoadFit {
  bool good = false;
  double mass_g = 0.0;
  hal::Quaternion sensor_to_tool;
  hal::Vector3 force_bias_n, torque_bias_n_mm;
  hal::Vector3 arm_mm;     ///< from the tip to the centre, r; zero if the tool hardly turned
  hal::Vector3 centre_mm;  ///< from the sensor's origin
  double mass_error_g = 0.0;
  hal::Vector3 rotation_error_rad, force_bias_error_n, torque_bias_error_n_mm, arm_error_mm, centre_error_mm;
  double force_rms_n = 0.0;  ///< of what is left, per component
  double torque_rms_n_mm = 0.0;
  double residual = 0.0;  ///< what is left over what force varies by
  bool has_torque = false;
};

struct ToolLoadOptions {
  bool turning = true;      ///< whether to look for the arm
  hal::Quaternion start{};  ///< where the search for sensor_to_tool starts, besides the data's own guess
};

/// Fits a load to sums. If some are centred and some are not, the biases are those of the latter. Least
/// squares over mass, rotation (proper), biases, arm and centre; force and torque weighed by what is left of
/// each. Gauss-Newton with Levenberg's damping on the sums. Not good if sums are not finite or empty.
ToolLoadFit fit_tool_load(const ToolMoments& moments, const ToolLoadOptions& options = {});

/// Mean square of what `fit` leaves of force [N²] and torque [N²·mm²] in other data, per component.
struct ToolLoadMisfit {
  double force_n2 = 0.0;
  double torque_n2_mm2 = 0.0;
};
ToolLoadMisfit misfit(const ToolLoadFit& fit, const ToolMoments& moments);

}  // namespace hapticd::identification
