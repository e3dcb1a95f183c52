#include "server/identification/estimate/friction/friction_level.h"

#include <algorithm>
#include <vector>

#include "server/linear_algebra/linear_algebra.h"

namespace hapticd::identification {

namespace {

/// cos² of the angle between the regressors of level and viscosity beyond which they cannot be distinguished.
constexpr double kAlike = 0.95;

}  // namespace

FrictionLevel FrictionLevelSums::solve(bool viscous, bool bias) const {
  FrictionLevel best;
  const double alike = ata_(0, 1) * ata_(0, 1) / (ata_(0, 0) * ata_(1, 1));
  best.viscous_is_identified = viscous && ata_(1, 1) > 0.0 && alike < kAlike;
  for (bool with_viscous = best.viscous_is_identified;; with_viscous = false) {
    std::vector<Eigen::Index> free{0};
    if (with_viscous) free.push_back(1);
    if (bias) free.push_back(2);
    const Eigen::MatrixXd part = ata_(free, free);
    const Eigen::VectorXd right = atb_(free);
    // Scaled to a unit diagonal: at the lightest touch newtons and millimetres a second are far apart.
    const Eigen::VectorXd scale =
        (part.diagonal().array() > 0.0).select(part.diagonal().array().max(1e-300).sqrt().inverse(), 1.0);
    const Eigen::MatrixXd scaled = scale.asDiagonal() * part * scale.asDiagonal();
    const Eigen::VectorXd x =
        scale.asDiagonal() * linear_algebra::solve_min_norm(scaled, scale.asDiagonal() * right);
    best.kinetic = x(0);
    best.viscous = with_viscous ? x(1) : 0.0;
    best.bias = bias ? x(free.size() == 3 ? 2 : 1) : 0.0;
    best.left = std::max(0.0, btb_ - 2.0 * x.dot(right) + x.dot(part * x));
    if (!with_viscous || best.viscous >= 0.0) return best;  // friction does not shrink with the speed
  }
}

}  // namespace hapticd::identification
