#include "server/identification/estimate/inclusion/grouped_least_squares.h"

#include <algorithm>
#include <cmath>

#include "server/linear_algebra/least_squares.h"

namespace hapticd::identification {

using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

using Residuals = std::function<VectorXd(const VectorXd&)>;

struct Limits {
  const VectorXd& steps;
  const VectorXd& low;
  const VectorXd& high;
};

struct Descent {
  VectorXd p;
  VectorXd residuals;
  MatrixXd slopes;
  bool converged = false;
};

MatrixXd slopes_of(const Residuals& residuals, const VectorXd& p, const VectorXd& here,
                   const Limits& limits) {
  MatrixXd j(here.size(), p.size());
  for (Eigen::Index k = 0; k < p.size(); ++k) {
    VectorXd moved = p;
    const double step = moved[k] + limits.steps[k] <= limits.high[k] ? limits.steps[k] : -limits.steps[k];
    moved[k] += step;
    j.col(k) = (residuals(moved) - here) / step;
  }
  return j;
}

Descent descend(const Residuals& residuals, const VectorXd& start, const Limits& limits) {
  Descent d;
  const auto minimum = linear_algebra::minimise(
      start,
      [&](const VectorXd& p) {
        d.residuals = residuals(p);
        d.slopes = slopes_of(residuals, p, d.residuals, limits);
        linear_algebra::NormalEquations equations(p.size());
        equations.add(d.slopes, d.residuals);
        return equations;
      },
      [&](const VectorXd& p) { return residuals(p).squaredNorm(); },
      [&](const VectorXd& p, const VectorXd& step) {
        return VectorXd((p + step).cwiseMax(limits.low).cwiseMin(limits.high));
      },
      {.gain_share = 1e-8});
  d.p = minimum.state;
  d.converged = minimum.converged;
  return d;
}

/// Size of what the law leaves over: the part of the residuals that goes on from one sample to the next.
/// Noise does not; one sample of it counts, so that the size is never zero.
double common_size(const VectorXd& residuals, const std::vector<std::size_t>& group_of,
                   std::size_t components) {
  double common = 0.0, squared = 0.0;
  for (std::size_t i = 0; i < group_of.size(); ++i) {
    const double here = residuals[static_cast<Eigen::Index>(i)];
    squared += here * here;
    const std::size_t next = i + components;
    if (next >= group_of.size() || group_of[next] != group_of[i]) continue;
    common += here * residuals[static_cast<Eigen::Index>(next)];
  }
  return std::sqrt(std::max(0.0, common) + squared / static_cast<double>(group_of.size()));
}

/// Covariance by how far the parameters move when one group after the other is left out (Bell and McCaffrey's
/// CR3).
MatrixXd jackknife(const MatrixXd& slopes, const VectorXd& residuals, const MatrixXd& inverse,
                   const std::vector<std::size_t>& group_of) {
  const Eigen::Index size = slopes.cols();
  MatrixXd scatter = MatrixXd::Zero(size, size);
  std::size_t groups = 0;
  for (Eigen::Index first = 0, end = 0; first < slopes.rows(); first = end) {
    while (end < slopes.rows() &&
           group_of[static_cast<std::size_t>(end)] == group_of[static_cast<std::size_t>(first)]) {
      ++end;
    }
    const MatrixXd j = slopes.middleRows(first, end - first);
    const MatrixXd rest = MatrixXd::Identity(size, size) - j.transpose() * j * inverse;
    const VectorXd score =
        linear_algebra::solve_least_squares(rest, j.transpose() * residuals.segment(first, end - first));
    scatter += score * score.transpose();
    ++groups;
  }
  return inverse * scatter * inverse * (1.0 - 1.0 / std::max(2.0, static_cast<double>(groups)));
}

}  // namespace

LeastSquaresSolution grouped_least_squares(const Residuals& residuals, VectorXd start, const VectorXd& steps,
                                           const VectorXd& low, const VectorXd& high,
                                           const std::vector<std::size_t>& group_of,
                                           const std::vector<PriorKnowledge>& priors,
                                           std::size_t components) {
  const Limits limits{steps, low, high};
  const auto data = static_cast<Eigen::Index>(group_of.size());
  const auto prior_count = static_cast<Eigen::Index>(priors.size());
  double scale = residuals(start).norm();
  const Residuals with_priors = [&](const VectorXd& p) {
    VectorXd r(data + prior_count);
    r.head(data) = residuals(p);
    for (Eigen::Index k = 0; k < prior_count; ++k) {
      const PriorKnowledge& prior = priors[static_cast<std::size_t>(k)];
      r[data + k] = scale * (p[prior.parameter] - prior.value) / prior.standard_deviation;
    }
    return r;
  };
  // First close to the priors, so as not to get lost; then by the data almost alone, for what is left over
  // then is what the law cannot follow.
  const int rounds = priors.empty() ? 1 : 3;
  Descent d;
  d.p = std::move(start);
  for (int round = 0; round < rounds; ++round) {
    d = descend(with_priors, d.p, limits);
    if (round == 0) scale = 1e-3 * d.residuals.head(data).norm();
    if (round == 1) scale = common_size(d.residuals, group_of, components);
  }

  LeastSquaresSolution s;
  const MatrixXd normal = d.slopes.transpose() * d.slopes;
  const MatrixXd inverse =
      linear_algebra::pseudo_inverse(normal + MatrixXd::Identity(normal.rows(), normal.cols()) * 1e-12);
  s.covariance = jackknife(d.slopes.topRows(data), d.residuals.head(data), inverse, group_of);
  for (Eigen::Index k = 0; k < prior_count; ++k) {
    // The prior is off by its deviation, whatever its residual is.
    const VectorXd moved = inverse * d.slopes.row(data + k).transpose() * scale;
    s.covariance += moved * moved.transpose();
  }
  s.parameters = d.p;
  s.standard_errors = s.covariance.diagonal().cwiseMax(0.0).cwiseSqrt();
  s.rms = std::sqrt(d.residuals.head(data).squaredNorm() / static_cast<double>(data));
  s.converged = d.converged;
  return s;
}

}  // namespace hapticd::identification
