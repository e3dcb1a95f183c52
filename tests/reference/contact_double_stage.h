#pragma once

#include <array>
#include <cstddef>
#include <optional>

#include "server/identification/estimate/contact/contact_estimate.h"

namespace hapticd::identification {

/// Recursive double-stage estimator of (4.22) (Diolaiti, Melchiorri, Stramigioli 2005): one least-squares
/// estimator finds K and B with the exponent of the other, f = K x^m + B x^m ẋ; one finds the exponent with K
/// and B of the first, ln(f/(K + Bẋ)) = m ln x, weighted by f². Each uses the other's last result, so old
/// samples were judged by worse estimates: they are forgotten. Displacements count in units near those where
/// most force is, or stiffness and exponent would be coupled and the two would never settle. Covariances are
/// bounded, and all is frozen out of contact. A candidate: its laws are worse than those of the service.
class DoubleStageEstimator {
 public:
  struct Options {
    double min_force_n = 0.1;
    double min_share = 0.1;      ///< of the deepest displacement
    double forgetting = 0.9997;  ///< λ per sample taken
    std::size_t fewest_samples = 100;
  };

  DoubleStageEstimator() : DoubleStageEstimator(Options{}) {}
  explicit DoubleStageEstimator(const Options& options) noexcept;

  void add(const PalpationSample& sample) noexcept {
    if (sample.in_contact && sample.normal_force_n > options_.min_force_n && sample.displacement_mm > 0.0) {
      take(sample.displacement_mm, sample.rate_mm_per_s, sample.normal_force_n);
    }
  }
  std::optional<HuntCrossleyEstimate> estimate() const;
  std::size_t samples() const noexcept { return samples_; }
  /// Largest element of both covariances, relative to where they began: never above 1.
  double covariance_share() const noexcept;

 private:
  void change_unit(double unit_mm) noexcept;
  void take(double displacement_mm, double rate_mm_per_s, double force_n) noexcept;

  Options options_;
  std::size_t samples_ = 0;
  double deepest_mm_ = 0.0;
  double unit_mm_ = 0.0;
  double stiffness_ = 0.0, damping_ = 0.0, exponent_ = 1.5;  ///< for displacements in units
  double p00_, p01_ = 0.0, p11_, q_;
};

}  // namespace hapticd::identification
