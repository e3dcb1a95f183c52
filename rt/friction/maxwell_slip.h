#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

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
};

/// Friction coefficient of elastic elements in parallel (Iwan 1966; the generalised Maxwell-slip model of
/// Lampaert, Al-Bender and Swevers 2003 at low speed). Unlike Dahl's it closes inner loops, as measured ones
/// do. Exact for steps of any length as long as the motion does not turn within one; time-free and
/// load-scaled.
class MaxwellSlip {
 public:
  explicit MaxwellSlip(const MaxwellSlipParameters& parameters) noexcept : parameters_(parameters) {}

  /// Friction against the motion over the normal force after sliding on by `slide_mm`; a step that is no
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

}  // namespace hapticd::rt
