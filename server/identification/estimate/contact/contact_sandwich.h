#pragma once

#include <Eigen/Core>
#include <cmath>
#include <cstddef>
#include <limits>

#include "server/linear_algebra/linear_algebra.h"

namespace hapticd::identification {

/// Covariance of least-squares parameters under residuals that are correlated over time: the normal matrix,
/// and the scores Jᵀe summed over consecutive blocks (Newey and West 1987, Bartlett's weights over a reach of
/// √blocks). For that many blocks the reach covers things that last up to about a seventh of the data.
template <int kMax>
class SandwichCovariance {
 public:
  using Vector = Eigen::Matrix<double, Eigen::Dynamic, 1, 0, kMax, 1>;
  using Matrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, kMax, kMax>;
  static constexpr std::size_t kBlocks = 48;

  SandwichCovariance(Eigen::Index parameters, std::size_t samples)
      : per_block_(samples / kBlocks + 1),
        normal_(Matrix::Zero(parameters, parameters)),
        scores_(Eigen::MatrixXd::Zero(parameters, static_cast<Eigen::Index>(kBlocks))) {}

  void add(const Vector& jacobian, double residual) {
    normal_.noalias() += jacobian * jacobian.transpose();
    scores_.col(static_cast<Eigen::Index>(count_ / per_block_)) += jacobian * residual;
    ++count_;
  }

  /// Covariance; infinite on the diagonal if the parameters cannot be distinguished.
  Matrix covariance() const {
    const Eigen::Index n = normal_.rows();
    const Matrix unknown = Matrix::Identity(n, n) * std::numeric_limits<double>::infinity();
    const auto blocks = static_cast<Eigen::Index>((count_ + per_block_ - 1) / per_block_);
    if (blocks < 2 * n + 2) return unknown;
    // Scaled to a unit diagonal, so that "cannot be distinguished" means the same in all units.
    const Vector scale = normal_.diagonal().cwiseSqrt().cwiseMax(1e-300).cwiseInverse();
    const Matrix scaled = scale.asDiagonal() * normal_ * scale.asDiagonal();
    const auto inverse_of_scaled = linear_algebra::invert_symmetric(scaled, 1e-13);
    if (!inverse_of_scaled) return unknown;
    const Matrix inverse = scale.asDiagonal() * *inverse_of_scaled * scale.asDiagonal();

    // If the estimate is not the least-squares one its scores have a mean; their scatter is what matters.
    Eigen::MatrixXd scores = scores_.leftCols(blocks);
    scores.colwise() -= scores.rowwise().mean().eval();
    const auto reach = static_cast<Eigen::Index>(std::sqrt(static_cast<double>(blocks)));
    Matrix spread = scores * scores.transpose();
    for (Eigen::Index lag = 1; lag <= reach; ++lag) {
      const Matrix between = scores.rightCols(blocks - lag) * scores.leftCols(blocks - lag).transpose();
      const double weight = 1.0 - static_cast<double>(lag) / static_cast<double>(reach + 1);
      spread += weight * (between + between.transpose());
    }
    spread *= static_cast<double>(blocks) / static_cast<double>(blocks - n);
    return inverse * spread * inverse;
  }

 private:
  std::size_t per_block_;
  std::size_t count_ = 0;
  Matrix normal_;
  Eigen::MatrixXd scores_;
};

}  // namespace hapticd::identification
