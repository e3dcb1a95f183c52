#include "server/identification/estimate/inclusion/grouped_least_squares.h"

#include <algorithm>
#include <cmath>

namespace hapticd::rt {

using Eigen::MatrixXd;
using Eigen::VectorXd;

LeastSquaresSolution grouped_least_squares(const std::function<VectorXd(const VectorXd&)>& residuals,
                                           VectorXd p, const VectorXd& steps, const VectorXd& low,
                                           const VectorXd& high, const std::vector<std::size_t>& group_of) {
  const auto slopes = [&](const VectorXd& at, const VectorXd& here) {
    MatrixXd j(here.size(), at.size());
    for (Eigen::Index k = 0; k < at.size(); ++k) {
      VectorXd moved = at;
      const double step = moved[k] + steps[k] <= high[k] ? steps[k] : -steps[k];
      moved[k] += step;
      j.col(k) = (residuals(moved) - here) / step;
    }
    return j;
  };
  LeastSquaresSolution s;
  double damping = 1e-3;
  VectorXd r = residuals(p);
  MatrixXd j = slopes(p, r);
  for (int i = 0; i < 100 && !s.converged; ++i) {
    const MatrixXd normal = j.transpose() * j;
    const VectorXd gradient = j.transpose() * r;
    bool better = false;
    for (int attempt = 0; attempt < 12 && !better; ++attempt) {
      MatrixXd damped = normal;
      damped.diagonal() += damping * normal.diagonal() + VectorXd::Constant(p.size(), 1e-12);
      const VectorXd next = (p - damped.ldlt().solve(gradient)).cwiseMax(low).cwiseMin(high);
      const VectorXd left = residuals(next);
      if (left.allFinite() && left.squaredNorm() < r.squaredNorm()) {
        s.converged = r.squaredNorm() - left.squaredNorm() < 1e-8 * r.squaredNorm();
        p = next;
        r = left;
        damping = std::max(1e-9, 0.2 * damping);
        better = true;
      } else {
        damping *= 5.0;
      }
    }
    if (!better) s.converged = true;
    j = slopes(p, r);
  }
  const MatrixXd inverse = (j.transpose() * j + MatrixXd::Identity(p.size(), p.size()) * 1e-12)
                               .completeOrthogonalDecomposition()
                               .pseudoInverse();
  MatrixXd scatter = MatrixXd::Zero(p.size(), p.size());
  VectorXd sum = VectorXd::Zero(p.size());
  for (Eigen::Index i = 0; i < r.size(); ++i) {
    sum += j.row(i).transpose() * r[i];
    const bool ends = i + 1 == r.size() ||
                      group_of[static_cast<std::size_t>(i + 1)] != group_of[static_cast<std::size_t>(i)];
    if (!ends) continue;
    scatter += sum * sum.transpose();
    sum.setZero();
  }
  s.parameters = p;
  s.standard_errors = (inverse * scatter * inverse).diagonal().cwiseMax(0.0).cwiseSqrt();
  s.rms = std::sqrt(r.squaredNorm() / static_cast<double>(r.size()));
  return s;
}

}  // namespace hapticd::rt
