#include "server/linear_algebra/least_squares.h"

namespace hapticd::linear_algebra {

using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

VectorXd scale_of(const MatrixView& a) {
  return a.diagonal().unaryExpr([](double d) { return d > 0.0 ? 1.0 / std::sqrt(d) : 1.0; });
}

}  // namespace

NormalEquations::NormalEquations(Eigen::Index unknowns)
    : information(MatrixXd::Zero(unknowns, unknowns)), right(VectorXd::Zero(unknowns)) {}

void NormalEquations::add(const MatrixView& jacobian, const VectorView& residuals, double weight) {
  information.noalias() += weight * (jacobian.transpose() * jacobian);
  right.noalias() -= weight * (jacobian.transpose() * residuals);
  cost += weight * residuals.squaredNorm();
}

VectorXd solve_scaled(const MatrixView& a, const VectorView& b) {
  const VectorXd scale = scale_of(a);
  const MatrixXd scaled = scale.asDiagonal() * a * scale.asDiagonal();
  return scale.asDiagonal() * solve_symmetric(scaled, scale.asDiagonal() * b);
}

MatrixXd invert_scaled(const MatrixView& a) {
  const VectorXd scale = scale_of(a);
  const MatrixXd scaled = scale.asDiagonal() * a * scale.asDiagonal();
  return scale.asDiagonal() * invert_symmetric(scaled) * scale.asDiagonal();
}

MatrixXd central_differences(const std::function<VectorXd(const VectorXd& step)>& residuals,
                             const VectorXd& h) {
  MatrixXd slopes;
  VectorXd step = VectorXd::Zero(h.size());
  for (Eigen::Index i = 0; i < h.size(); ++i) {
    step[i] = h[i];
    const VectorXd above = residuals(step);
    step[i] = -h[i];
    const VectorXd below = residuals(step);
    step[i] = 0.0;
    if (i == 0) slopes.resize(above.size(), h.size());
    slopes.col(i) = (above - below) / (2.0 * h[i]);
  }
  return slopes;
}

VectorXd damped_step(const NormalEquations& equations, double damping) {
  MatrixXd damped = equations.information;
  damped.diagonal() *= 1.0 + damping;
  return solve_scaled(damped, equations.right);
}

double predicted_gain(const NormalEquations& equations, const VectorView& step) {
  return 2.0 * equations.right.dot(step) - step.dot(equations.information * step);
}

}  // namespace hapticd::linear_algebra
