#pragma once

#include <array>
#include <cstddef>
#include <vector>

#include "hal/samples.h"
#include "rt/model/identified_model.h"
#include "rt/model/structural_model.h"

namespace hapticd::identification {

/// One tick of a press along one axis.
struct StructuralRow {
  hal::Vector3 place_mm;  ///< of the tip by the encoders
  double force_n = 0.0;   ///< of the device
  double speed_mm_per_s = 0.0;
  double force_rate_n_per_s = 0.0;
  double deflection_mm = 0.0;  ///< true tip minus encoders
};

/// Sums over the rows of one press along one axis, which is all that the fit needs of them:
///   deflection = o - c(p) f + c F sgn(v) + τ df/dt,
/// c(p) a polynomial of second order about a fixed origin.
struct StructuralSums {
  static constexpr std::size_t kRegressors = 12;  ///< 10 of the field, friction, delay

  void add(const StructuralRow& row) noexcept;

  std::array<double, (kRegressors + 1) * (kRegressors + 2) / 2> product{};  ///< deflection last
  std::array<double, kRegressors + 1> sum{};
  double rows = 0.0;
};

/// Sums and facts that the fit needs of one press.
struct StructuralPress {
  std::array<StructuralSums, 3> axes;
  hal::Vector3 place_mm;  ///< where the force was greatest
  int axis = 2;           ///< along which it was
};

struct StructuralFit {
  bool good = false;
  int order = -1;  ///< 0 constant, 1 linear, 2 quadratic
  rt::StructuralModel model;
  std::vector<rt::EstimatedParameter> parameters;
  double centre_error = 0.0;  ///< relative standard error of c at the centre
  double worst_error = 0.0;   ///< and the greatest at any of the presses
  double residual = 0.0;      ///< rms left over rms of the deflection
  double residual_mm = 0.0;
  double spread = 0.0;       ///< constant: presses differ by so much in their own stiffness, relative
  std::size_t left_out = 0;  ///< presses that fit four times worse than the others
};

/// Structural stiffness and its field from presses, by linear least squares within each press about its own
/// mean (D§4.6.1, (4.26)). Takes the highest order up to `highest_order` that the presses determine; standard
/// errors are the greater of two: by the number of independent residuals, and by how much presses disagree
/// (Liang and Zeger 1986). Not good if not even a constant is determined.
StructuralFit fit_structural(const std::vector<const StructuralPress*>& presses, int highest_order,
                             double rate_hz);

}  // namespace hapticd::identification
