#pragma once

#include <Eigen/Dense>
#include <cmath>
#include <cstddef>
#include <optional>

#include "server/identification/estimate/contact/contact_estimate.h"

namespace hapticd::study {

/// The single-stage estimator as it was published (Haddadi and Hashtrudi-Zaad 2012), for comparison:
///
///   ln f = ln K + m ln x + (B/K) ẋ,  recursive least squares over every sample in contact, all alike,
///
/// without a gate on depth, force or speed. In the information form without forgetting, which is the same
/// estimate as the recursion with a covariance that began large.
class LogLeastSquares {
 public:
  void add(const identification::PalpationSample& s) noexcept {
    if (!identification::identifies_contact(s)) return;
    const Eigen::Vector3d phi(1.0, std::log(s.displacement_mm), s.rate_mm_per_s);
    normal_ += phi * phi.transpose();
    right_ += std::log(s.normal_force_n) * phi;
    ++samples_;
  }

  /// Estimate; none if the samples do not determine the parameters apart.
  std::optional<identification::HuntCrossleyEstimate> estimate() const {
    if (!(normal_.diagonal().minCoeff() > 0.0)) return std::nullopt;
    const Eigen::Vector3d scale = normal_.diagonal().cwiseSqrt().cwiseInverse();
    const auto factors = Eigen::Matrix3d(scale.asDiagonal() * normal_ * scale.asDiagonal()).ldlt();
    if (samples_ < 3 || !(factors.rcond() > 1e-12)) return std::nullopt;
    const Eigen::Vector3d solution = scale.asDiagonal() * factors.solve(scale.asDiagonal() * right_);
    identification::HuntCrossleyEstimate estimate;
    estimate.parameters.stiffness_n_per_mm_m = std::exp(solution(0));
    estimate.parameters.exponent = solution(1);
    estimate.parameters.damping_n_s_per_mm_m1 = solution(2) * estimate.parameters.stiffness_n_per_mm_m;
    estimate.samples = samples_;
    return estimate;
  }

 private:
  Eigen::Matrix3d normal_ = Eigen::Matrix3d::Zero();
  Eigen::Vector3d right_ = Eigen::Vector3d::Zero();
  std::size_t samples_ = 0;
};

}  // namespace hapticd::study
