#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <Eigen/SVD>

#include "server/linear_algebra/linear_algebra.h"

namespace hapticd::linear_algebra {

using Eigen::MatrixXd;

std::optional<MatrixXd> invert(const MatrixView& a, double min_reciprocal_condition) {
  const Eigen::FullPivLU<MatrixXd> factors(a);
  if (!factors.isInvertible() || !(factors.rcond() > min_reciprocal_condition)) return std::nullopt;
  return MatrixXd(factors.inverse());
}

ConditionedSolution solve_by_singular_values(const MatrixView& a, const VectorView& b) {
  const Eigen::JacobiSVD<MatrixXd> svd(a, Eigen::ComputeThinU | Eigen::ComputeThinV);
  return {svd.solve(b), svd.singularValues()(a.cols() - 1) / svd.singularValues()(0)};
}

SingularValues3 singular_values(const Eigen::Matrix3d& a) {
  const Eigen::JacobiSVD<MatrixXd> svd(a, Eigen::ComputeFullU | Eigen::ComputeFullV);
  return {svd.matrixU(), svd.singularValues(), svd.matrixV()};
}

SymmetricEigen symmetric_eigen(const MatrixView& a) {
  const Eigen::SelfAdjointEigenSolver<MatrixXd> solver(a);
  return {solver.eigenvalues(), solver.eigenvectors(), solver.info() == Eigen::Success};
}

}  // namespace hapticd::linear_algebra
