#pragma once

#include <array>
#include <cmath>
#include <cstddef>

namespace hapticd::study::extremes {

/// Recursive least squares with forgetting as textbooks have it (Åström and Wittenmark), for the log-linear
/// single stage ln f = ln K + m ln x + (B/K) ẋ:
///
///   L = P φ/(λ + φᵀ P φ),  θ ← θ + L (y - φᵀ θ),  P ← (P - L φᵀ P)/λ.
///
/// Recursive least squares of the textbook: its covariance grows by 1/λ a sample in every direction that the
/// data do not excite (wind-up), until the update's rounding costs it symmetry and definiteness. hapticd does
/// not use it: here to be seen next to what it does use.
class TextbookRls {
 public:
  static constexpr std::size_t kSize = 3;
  using Vector = std::array<double, kSize>;
  using Matrix = std::array<Vector, kSize>;

  TextbookRls(double forgetting, double first_variance) noexcept : forgetting_(forgetting) {
    for (std::size_t i = 0; i < kSize; ++i) covariance_[i][i] = first_variance;
  }

  void add(const Vector& regressor, double observed) noexcept {
    Vector p_phi{}, phi_p{};
    for (std::size_t i = 0; i < kSize; ++i) {
      for (std::size_t j = 0; j < kSize; ++j) {
        p_phi[i] += covariance_[i][j] * regressor[j];
        phi_p[i] += regressor[j] * covariance_[j][i];
      }
    }
    double denominator = forgetting_;
    double error = observed;
    for (std::size_t i = 0; i < kSize; ++i) {
      denominator += regressor[i] * p_phi[i];
      error -= regressor[i] * parameters_[i];
    }
    for (std::size_t i = 0; i < kSize; ++i) {
      parameters_[i] += p_phi[i] / denominator * error;
      for (std::size_t j = 0; j < kSize; ++j) {
        covariance_[i][j] = (covariance_[i][j] - p_phi[i] / denominator * phi_p[j]) / forgetting_;
      }
    }
  }

  const Vector& parameters() const noexcept { return parameters_; }
  const Matrix& covariance() const noexcept { return covariance_; }

 private:
  double forgetting_;
  Vector parameters_{};
  Matrix covariance_{};
};

}  // namespace hapticd::study::extremes
