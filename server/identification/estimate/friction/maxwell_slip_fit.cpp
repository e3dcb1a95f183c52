#include "server/identification/estimate/friction/maxwell_slip_fit.h"

#include <Eigen/Core>
#include <algorithm>
#include <cmath>

#include "server/linear_algebra/linear_algebra.h"

namespace hapticd::identification {

namespace {

/// Minimises |A y - b| with y ≥ 0 but for the last component, which is free: Lawson and Hanson's active set
/// on the normal equations.
Eigen::VectorXd non_negative(const Eigen::MatrixXd& ata, const Eigen::VectorXd& atb, bool last_is_free) {
  const Eigen::Index n = atb.size();
  Eigen::VectorXd y = Eigen::VectorXd::Zero(n);
  std::vector<bool> active(static_cast<std::size_t>(n), false);
  const auto unbounded = [&](Eigen::Index i) { return last_is_free && i == n - 1; };
  const auto solve = [&] {
    std::vector<Eigen::Index> index;
    for (Eigen::Index i = 0; i < n; ++i) {
      if (active[static_cast<std::size_t>(i)]) index.push_back(i);
    }
    Eigen::VectorXd s = Eigen::VectorXd::Zero(n);
    if (index.empty()) return s;
    const Eigen::MatrixXd part = ata(index, index);
    const Eigen::VectorXd right = atb(index);
    const Eigen::VectorXd solution = linear_algebra::solve_min_norm(part, right);
    s(index) = solution;
    return s;
  };
  if (last_is_free) active.back() = true;
  y = solve();
  for (Eigen::Index outer = 0; outer < 3 * n; ++outer) {
    const Eigen::VectorXd gradient = atb - ata * y;
    Eigen::Index enter = -1;
    double steepest = 1e-9 * atb.cwiseAbs().maxCoeff();
    for (Eigen::Index i = 0; i < n; ++i) {
      if (!active[static_cast<std::size_t>(i)] && gradient(i) > steepest) {
        steepest = gradient(i);
        enter = i;
      }
    }
    if (enter < 0) break;
    active[static_cast<std::size_t>(enter)] = true;
    for (Eigen::Index inner = 0; inner < n; ++inner) {
      const Eigen::VectorXd s = solve();
      double step = 1.0;
      for (Eigen::Index i = 0; i < n; ++i) {
        if (active[static_cast<std::size_t>(i)] && !unbounded(i) && s(i) <= 0.0) {
          step = std::min(step, y(i) / (y(i) - s(i)));
        }
      }
      y += step * (s - y);
      if (step >= 1.0) break;
      for (Eigen::Index i = 0; i < n; ++i) {
        if (active[static_cast<std::size_t>(i)] && !unbounded(i) && y(i) <= 1e-14) {
          active[static_cast<std::size_t>(i)] = false;
          y(i) = 0.0;
        }
      }
    }
  }
  return y;
}

/// Stretch of one element at each row.
std::vector<double> stretched(const std::vector<FrictionRow>& rows, double reach_mm) {
  std::vector<double> stretch(rows.size());
  double now = 0.0;
  for (std::size_t i = 0; i < rows.size(); ++i) {
    if (rows[i].before != FrictionRow::State::kGoesOn) now = reach_mm * state_before(rows[i], 0.0);
    now = std::clamp(now + rows[i].slide_mm, -reach_mm, reach_mm);
    stretch[i] = now;
  }
  return stretch;
}

}  // namespace

hal::Result<MaxwellSlipFit> fit_maxwell_slip(const std::vector<FrictionRow>& rows,
                                             const MaxwellSlipFitOptions& options) {
  double longest_mm = 0.0;
  for (const FrictionRow& row : rows) longest_mm = std::max(longest_mm, row.path_mm);
  if (!(longest_mm > 0.0)) {
    return cannot_fit_friction("the tip did not slide", std::to_string(rows.size()) + " moments",
                               "strokes both ways", "stroke back and forth over the same place");
  }
  const auto solve = [&](const std::vector<double>& reaches, double& left, double& squared) {
    const auto elements = static_cast<Eigen::Index>(reaches.size());
    const Eigen::Index n = elements + (options.viscous ? 1 : 0) + (options.bias ? 1 : 0);
    std::vector<std::vector<double>> stretch;
    for (const double reach_mm : reaches) stretch.push_back(stretched(rows, reach_mm));
    Eigen::MatrixXd ata = Eigen::MatrixXd::Zero(n, n);
    Eigen::VectorXd atb = Eigen::VectorXd::Zero(n);
    squared = 0.0;
    Eigen::VectorXd a(n);
    for (std::size_t i = 0; i < rows.size(); ++i) {
      if (!rows[i].settled || std::abs(rows[i].speed_mm_per_s) < options.min_speed_mm_per_s) continue;
      for (std::size_t j = 0; j < reaches.size(); ++j) {
        a(static_cast<Eigen::Index>(j)) = rows[i].normal_n * stretch[j][i];
      }
      if (options.viscous) a(elements) = rows[i].speed_mm_per_s;
      if (options.bias) a(n - 1) = 1.0;
      ata.selfadjointView<Eigen::Lower>().rankUpdate(a, rows[i].weight);
      atb += rows[i].weight * rows[i].friction_n * a;
      squared += rows[i].weight * rows[i].friction_n * rows[i].friction_n;
    }
    ata = Eigen::MatrixXd(ata.selfadjointView<Eigen::Lower>());
    Eigen::VectorXd y = non_negative(ata, atb, options.bias);
    left = std::max(0.0, squared - 2.0 * y.dot(atb) + y.dot(ata * y));
    return y;
  };

  constexpr int kLadder = 28;
  // Half a way is the longest reach that ever slips; the first step of the ladder is a hundredth of it.
  std::vector<double> reaches;
  for (int i = 0; i < kLadder; ++i) {
    reaches.push_back(0.5 * longest_mm * std::pow(100.0, static_cast<double>(i) / (kLadder - 1) - 1.0));
  }
  double left = 0.0;
  double squared = 0.0;
  Eigen::VectorXd y = solve(reaches, left, squared);
  // The few that carry most of the level, then once more.
  for (std::size_t most = rt::MaxwellSlipParameters::kElements; true;) {
    std::vector<std::size_t> order;
    for (std::size_t j = 0; j < reaches.size(); ++j) {
      if (y(static_cast<Eigen::Index>(j)) > 0.0) order.push_back(j);
    }
    const auto level = [&](std::size_t j) { return y(static_cast<Eigen::Index>(j)) * reaches[j]; };
    std::sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) { return level(a) > level(b); });
    if (order.size() > most) order.resize(most);
    std::sort(order.begin(), order.end());
    std::vector<double> kept;
    for (const std::size_t j : order) kept.push_back(reaches[j]);
    const bool same = kept.size() == reaches.size();
    reaches = kept;
    if (reaches.empty()) break;
    if (same) break;
    y = solve(reaches, left, squared);
  }
  if (reaches.empty()) {
    return cannot_fit_friction("friction goes along with the motion instead of against it", "", "",
                               "turn the sign of the force or of the position");
  }
  MaxwellSlipFit fit;
  for (std::size_t j = 0; j < reaches.size(); ++j) {
    fit.parameters.reach_mm[j] = reaches[j];
    fit.parameters.stiffness_per_mm[j] = y(static_cast<Eigen::Index>(j));
  }
  if (options.viscous) fit.viscous_n_s_per_mm = y(static_cast<Eigen::Index>(reaches.size()));
  if (options.bias) fit.bias_n = y(y.size() - 1);
  fit.residual = squared > 0.0 ? std::sqrt(left / squared) : 0.0;
  return fit;
}

std::vector<double> predicted_friction_n(const std::vector<FrictionRow>& rows, const MaxwellSlipFit& fit) {
  const rt::MaxwellSlipParameters& parameters = fit.parameters;
  std::vector<double> friction(rows.size(), fit.bias_n);
  for (std::size_t i = 0; i < rows.size(); ++i)
    friction[i] += fit.viscous_n_s_per_mm * rows[i].speed_mm_per_s;
  for (std::size_t e = 0; e < parameters.reach_mm.size(); ++e) {
    if (!(parameters.reach_mm[e] > 0.0)) continue;
    const std::vector<double> stretch = stretched(rows, parameters.reach_mm[e]);
    for (std::size_t i = 0; i < rows.size(); ++i) {
      friction[i] += parameters.stiffness_per_mm[e] * rows[i].normal_n * stretch[i];
    }
  }
  return friction;
}

}  // namespace hapticd::identification
