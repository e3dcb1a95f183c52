#include "server/linear_algebra/linear_algebra.h"

#include <Eigen/Cholesky>
#include <Eigen/QR>

namespace hapticd::linear_algebra {

using Eigen::MatrixXd;
using Eigen::VectorXd;

VectorXd solve_symmetric(const MatrixView& a, const VectorView& b) {
  return Eigen::LDLT<MatrixXd>(a).solve(b);
}

std::optional<VectorXd> solve_symmetric(const MatrixView& a, const VectorView& b, double min_pivot) {
  const Eigen::LDLT<MatrixXd> factors(a);
  if (!(factors.vectorD().minCoeff() > min_pivot) || !(factors.rcond() > min_pivot)) return std::nullopt;
  return VectorXd(factors.solve(b));
}

MatrixXd solve_symmetric_columns(const MatrixView& a, const MatrixView& b) {
  return Eigen::LDLT<MatrixXd>(a).solve(b);
}

MatrixXd invert_symmetric(const MatrixView& a) {
  return solve_symmetric_columns(a, MatrixXd::Identity(a.rows(), a.cols()));
}

std::optional<MatrixXd> invert_symmetric(const MatrixView& a, double min_reciprocal_condition) {
  const Eigen::LDLT<MatrixXd> factors(a);
  if (!(factors.rcond() > min_reciprocal_condition)) return std::nullopt;
  return MatrixXd(factors.solve(MatrixXd::Identity(a.rows(), a.cols())));
}

VectorXd solve_least_squares(const MatrixView& a, const VectorView& b) {
  return Eigen::ColPivHouseholderQR<MatrixXd>(a).solve(b);
}

VectorXd solve_min_norm(const MatrixView& a, const VectorView& b) {
  return Eigen::CompleteOrthogonalDecomposition<MatrixXd>(a).solve(b);
}

MatrixXd pseudo_inverse(const MatrixView& a) {
  return Eigen::CompleteOrthogonalDecomposition<MatrixXd>(a).pseudoInverse();
}

}  // namespace hapticd::linear_algebra
