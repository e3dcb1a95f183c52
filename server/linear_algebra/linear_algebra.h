#pragma once

#include <Eigen/Core>
#include <optional>

/// Decompositions of small dense matrices, each compiled once. Every file that calls Eigen's own costs its
/// compiler seconds for each of them and each size; the sizes here are dynamic, so they allocate: not for the
/// tick.
namespace hapticd::linear_algebra {

using MatrixView = Eigen::Ref<const Eigen::MatrixXd>;
using VectorView = Eigen::Ref<const Eigen::VectorXd>;

/// Solves a x = b for a symmetric, positive or negative semidefinite `a` (n×n) by LDLᵀ with pivoting; `b` has
/// n rows. The result is not finite if `a` or `b` are not.
Eigen::VectorXd solve_symmetric(const MatrixView& a, const VectorView& b);
Eigen::MatrixXd solve_symmetric_columns(const MatrixView& a, const MatrixView& b);

/// Solves a symmetric system; returns nothing if a pivot or the estimated reciprocal condition number is not
/// above `min_pivot`. For sums that are scaled to a unit diagonal: a pivot that is exactly zero is left out
/// of the condition number.
std::optional<Eigen::VectorXd> solve_symmetric(const MatrixView& a, const VectorView& b, double min_pivot);

/// Inverts a symmetric, positive or negative semidefinite `a`.
Eigen::MatrixXd invert_symmetric(const MatrixView& a);
/// Returns nothing if the estimated reciprocal condition number is not above `min_reciprocal_condition`.
std::optional<Eigen::MatrixXd> invert_symmetric(const MatrixView& a, double min_reciprocal_condition);

/// Inverts a square `a` by LU with full pivoting. Returns nothing if its rank is not full, or if the
/// estimated reciprocal condition number is not above `min_reciprocal_condition`.
std::optional<Eigen::MatrixXd> invert(const MatrixView& a, double min_reciprocal_condition);

/// Minimises |a x - b| by QR with column pivoting; `a` (m×n, m ≥ n) has full rank.
Eigen::VectorXd solve_least_squares(const MatrixView& a, const VectorView& b);
/// Minimises |a x - b|, and of all such x takes the shortest: `a` may have any rank.
Eigen::VectorXd solve_min_norm(const MatrixView& a, const VectorView& b);
/// The pseudo-inverse, by the same decomposition.
Eigen::MatrixXd pseudo_inverse(const MatrixView& a);

struct ConditionedSolution {
  Eigen::VectorXd x;
  double reciprocal_condition = 0.0;  ///< smallest over largest singular value, 0 … 1
};
/// Minimises |a x - b| by singular values; `a` is m×n with m ≥ n.
ConditionedSolution solve_by_singular_values(const MatrixView& a, const VectorView& b);

/// a = u · diag(values) · vᵀ; u and v are orthogonal, the values descend.
struct SingularValues3 {
  Eigen::Matrix3d u;
  Eigen::Vector3d values;
  Eigen::Matrix3d v;
};
SingularValues3 singular_values(const Eigen::Matrix3d& a);

/// a = vectors · diag(values) · vectorsᵀ; the values ascend. Only the lower triangle of `a` is read.
struct SymmetricEigen {
  Eigen::VectorXd values;
  Eigen::MatrixXd vectors;
  bool converged = false;
};
SymmetricEigen symmetric_eigen(const MatrixView& a);

}  // namespace hapticd::linear_algebra
