#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <functional>
#include <optional>
#include <utility>

#include "server/linear_algebra/linear_algebra.h"

/// Least squares, linear and not, of small dense problems. All of it allocates: not for the tick.
namespace hapticd::linear_algebra {

/// A sum of weighted squares near a state: Σ w |r + J step|² = cost - 2 rightᵀ step + stepᵀ information step.
struct NormalEquations {
  Eigen::MatrixXd information;  ///< Σ w Jᵀ J
  Eigen::VectorXd right;        ///< -Σ w Jᵀ r
  double cost = 0.0;            ///< Σ w rᵀ r

  explicit NormalEquations(Eigen::Index unknowns);
  /// Adds residuals r and their slopes J (one row per residual) with one weight.
  void add(const MatrixView& jacobian, const VectorView& residuals, double weight = 1.0);
};

/// Solves a x = b for a symmetric, positive semidefinite `a`, scaled to a diagonal of ones: unknowns may have
/// any units. An unknown whose diagonal is zero gets 0.
Eigen::VectorXd solve_scaled(const MatrixView& a, const VectorView& b);
/// Inverts such an `a`; rows and columns whose diagonal is zero stay zero.
Eigen::MatrixXd invert_scaled(const MatrixView& a);

/// Slopes of `residuals` at a step of zero by central differences, one column per unknown, `h` wide to both
/// sides. Second order: the error is h²/6 of the third derivative, and rounding, 1e-16 |r| / h.
Eigen::MatrixXd central_differences(
    const std::function<Eigen::VectorXd(const Eigen::VectorXd& step)>& residuals, const Eigen::VectorXd& h);

/// Weight of a residual that is `s` standard deviations long: |r| instead of r² beyond one of them.
inline double soft_l1(double s) noexcept {
  return 1.0 / std::sqrt(1.0 + s * s);
}
/// Tukey's biweight: from 1 to 0 at `end` standard deviations, and 0 beyond.
inline double tukey(double s, double end) noexcept {
  const double u = s / end;
  return std::abs(u) < 1.0 ? (1.0 - u * u) * (1.0 - u * u) : 0.0;
}

/// A descent ends after the first step that lowers the cost by no more than `gain_share` of it or by no more
/// than `gain`; when no step lowers the cost, down to one that promises no more than that; or after
/// `max_iterations` steps, not converged.
struct StopRule {
  double gain_share = 1e-10;
  double gain = 0.0;
  int max_iterations = 100;
};

template <class State>
struct Minimum {
  State state;
  NormalEquations equations;  ///< at this state
  bool converged = false;
};

/// Solves for the step of a damped descent: (information + damping · its diagonal) step = right.
Eigen::VectorXd damped_step(const NormalEquations& equations, double damping);
/// Decrease of the cost that the normal equations predict for a step.
double predicted_gain(const NormalEquations& equations, const VectorView& step);

/// Minimises a sum of squares by Levenberg and Marquardt, from `start` to the next minimum: quadratic where
/// the residuals are small. Only steps that lower the cost are taken. Unknowns that the residuals do not show
/// stay as they are. If the cost at the start is not finite, the start comes back, not converged; a step to
/// where the cost is not finite is refused. `linearise(state)`: NormalEquations there. It may choose new
/// weights, by which the cost is measured until it is called again; its last call is at the state that is
/// returned. `cost(state)`: the cost alone, by the weights of the last linearisation. `moved(state, step)`: a
/// state after a step, inside its bounds; for rotations their own composition.
template <class State, class Linearise, class Cost, class Moved>
Minimum<State> minimise(State start, Linearise&& linearise, Cost&& cost, Moved&& moved,
                        const StopRule& stop = {}) {
  NormalEquations first = linearise(start);
  Minimum<State> m{std::move(start), std::move(first)};
  double damping = 1e-3;
  for (int i = 0; i < stop.max_iterations && std::isfinite(m.equations.cost) && !m.converged; ++i) {
    const double negligible = std::max(stop.gain, stop.gain_share * m.equations.cost);
    std::optional<State> better;
    while (!better) {
      const Eigen::VectorXd step = damped_step(m.equations, damping);
      State trial = moved(m.state, step);
      const double gain = m.equations.cost - cost(trial);
      if (gain > 0.0) {
        better = std::move(trial);
        damping = std::max(1e-12, 0.1 * damping);
        m.converged = gain <= negligible;
      } else {
        const double predicted = predicted_gain(m.equations, step);
        if (!(predicted > negligible)) {
          m.converged = !std::isnan(predicted);
          return m;
        }
        damping *= 10.0;
      }
    }
    m.state = std::move(*better);
    m.equations = linearise(m.state);
  }
  return m;
}

}  // namespace hapticd::linear_algebra
