#include <Eigen/QR>

#include "server/linear_algebra/linear_algebra.h"

namespace hapticd::linear_algebra {

using Eigen::MatrixXd;
using Eigen::VectorXd;

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
