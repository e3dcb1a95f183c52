#include <Eigen/Cholesky>

#include "server/linear_algebra/linear_algebra.h"

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

}  // namespace hapticd::linear_algebra
