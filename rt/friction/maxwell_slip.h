#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

#include "rt/signal/vector.h"

namespace hapticd::rt {

/// Elements of a Maxwell-slip law: each is a spring that is dragged along once it is stretched by its reach.
struct MaxwellSlipParameters {
  static constexpr std::size_t kElements = 8;
  std::array<double, kElements> reach_mm{};          ///< ≥ 0; 0 = the element is not there
  std::array<double, kElements> stiffness_per_mm{};  ///< tangential force per normal force and mm, ≥ 0

  /// μ_k: the share of the normal force once every element slips.
  double kinetic() const noexcept {
    double sum = 0.0;
    for (std::size_t i = 0; i < kElements; ++i) sum += reach_mm[i] * stiffness_per_mm[i];
    return sum;
  }
  /// Distance over which friction would reach its level if it went on rising as at first; 0 without elements.
  double presliding_mm() const noexcept {
    double slope_per_mm = 0.0;
    for (std::size_t i = 0; i < kElements; ++i) {
      if (reach_mm[i] > 0.0) slope_per_mm += stiffness_per_mm[i];
    }
    return slope_per_mm > 0.0 ? kinetic() / slope_per_mm : 0.0;
  }
};

/// Friction coefficient of elastic elements in parallel (Iwan 1966; the generalised Maxwell-slip model of
/// Lampaert, Al-Bender and Swevers 2003 at low speed). Unlike Dahl's it closes inner loops, as measured ones
/// do. Exact for steps of any length as long as the motion does not turn within one; time-free and
/// load-scaled.
class MaxwellSlip {
 public:
  explicit MaxwellSlip(const MaxwellSlipParameters& parameters) noexcept : parameters_(parameters) {}

  /// Friction against the motion over the normal force after sliding on by `slide_mm`; a step that is not a
  /// number moves nothing.
  double step(double slide_mm) noexcept {
    if (std::isnan(slide_mm)) slide_mm = 0.0;
    double coefficient = 0.0;
    for (std::size_t i = 0; i < stretch_mm_.size(); ++i) {
      const double reach_mm = parameters_.reach_mm[i];
      stretch_mm_[i] = std::clamp(stretch_mm_[i] + slide_mm, -reach_mm, reach_mm);
      coefficient += parameters_.stiffness_per_mm[i] * stretch_mm_[i];
    }
    return coefficient;
  }
  void release() noexcept { stretch_mm_ = {}; }

 private:
  MaxwellSlipParameters parameters_;
  std::array<double, MaxwellSlipParameters::kElements> stretch_mm_{};
};

/// One element's stretch after a slide in the tangent plane: an element that slips returns radially to its
/// reach, so that its stretch is never longer and, sliding on in one direction, comes to point along it. A
/// slide that is not a number, or infinite, moves nothing.
inline hal::Vector3 maxwell_slip_step(const hal::Vector3& stretch_mm, const hal::Vector3& slide_mm,
                                      double reach_mm) noexcept {
  const hal::Vector3 pulled_mm = stretch_mm + slide_mm;
  const double squared_mm2 = dot(pulled_mm, pulled_mm);
  if (!std::isfinite(squared_mm2)) return stretch_mm;
  return squared_mm2 > reach_mm * reach_mm ? pulled_mm * (reach_mm / std::sqrt(squared_mm2)) : pulled_mm;
}

/// MaxwellSlip in the tangent plane.
class PlanarMaxwellSlip {
 public:
  explicit PlanarMaxwellSlip(const MaxwellSlipParameters& parameters) noexcept : parameters_(parameters) {}

  /// Friction against the motion over the normal force, as a vector, after sliding on by `slide_mm` in the
  /// plane across `normal` (length 1). What was built up is carried along as the plane turns.
  hal::Vector3 step(const hal::Vector3& slide_mm, const hal::Vector3& normal) noexcept {
    hal::Vector3 coefficient;
    for (std::size_t i = 0; i < stretch_mm_.size(); ++i) {
      stretch_mm_[i] = maxwell_slip_step(across(stretch_mm_[i], normal), slide_mm, parameters_.reach_mm[i]);
      coefficient = coefficient + stretch_mm_[i] * parameters_.stiffness_per_mm[i];
    }
    return coefficient;
  }
  void release() noexcept { stretch_mm_ = {}; }

 private:
  MaxwellSlipParameters parameters_;
  std::array<hal::Vector3, MaxwellSlipParameters::kElements> stretch_mm_{};
};

}  // namespace hapticd::rt
