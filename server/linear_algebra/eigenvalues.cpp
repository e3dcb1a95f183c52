#include <Eigen/Eigenvalues>
#include <Eigen/LU>

#include "server/linear_algebra/linear_algebra.h"

namespace hapticd::linear_algebra {

using Eigen::MatrixXd;

std::optional<MatrixXd> invert(const MatrixView& a, double min_reciprocal_condition) {
  const Eigen::FullPivLU<MatrixXd> factors(a);
  if (!factors.isInvertible() || !(factors.rcond() > min_reciprocal_condition)) return std::nullopt;
  return MatrixXd(factors.inverse());
}

SymmetricEigen symmetric_eigen(const MatrixView& a) {
  const Eigen::SelfAdjointEigenSolver<MatrixXd> solver(a);
  return {solver.eigenvalues(), solver.eigenvectors(), solver.info() == Eigen::Success};
}

}  // namespace hapticd::linear_algebra
