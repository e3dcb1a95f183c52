#include "server/calibration/estimate/arm_solver.h"

#include <Eigen/Core>
#include <algorithm>
#include <cmath>

#include "server/calibration/estimate/median.h"
#include "server/linear_algebra/linear_algebra.h"

namespace hapticd::calibration {

namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr int kMaxRounds = 40;
/// Tukey's biweight for three numbers together: 0.3 % of good poses lie beyond two thirds of it.
constexpr double kTukey = 6.0;
constexpr double kMinNoiseMm = 1e-4;
constexpr double kMinNoiseRad = 1e-6;

/// Steps of the numerical derivative, about 1e-6 of what an unknown may be.
UnknownVector difference_steps() {
  UnknownVector h = UnknownVector::Constant(1e-6);
  h.segment<2>(parameter::kLink).setConstant(1e-4);
  h.segment<3>(unknown::kTranslation).setConstant(1e-4);
  h.segment<3>(unknown::kMarker).setConstant(1e-4);
  // Angles run straight between two ticks: a step across several.
  h[unknown::kLatency] = 2e-3;
  h[unknown::kDrift] = 1e-5;
  return h;
}

double soft_l1(double s) {
  return 1.0 / std::sqrt(1.0 + s * s);
}
double tukey(double s) {
  const double u = s / kTukey;
  return u < 1.0 ? (1.0 - u * u) * (1.0 - u * u) : 0.0;
}

class Solver {
 public:
  Solver(const RigStream& rig, const ArmState& start, const std::array<bool, unknown::kCount>& active)
      : rig_(rig) {
    solved_.state = start;
    solved_.active = active;
    const UnknownVector sd = prior_sd();
    for (int i = 0; i < unknown::kCount; ++i) {
      if (active[static_cast<std::size_t>(i)] && sd[i] > 0.0) {
        solved_.prior_information[i] = 1.0 / (sd[i] * sd[i]);
      }
    }
  }

  Solved run(const std::vector<const ReferencePose*>& seen) {
    for (const ReferencePose* pose : seen) {
      if (residual_of(solved_.state, rig_, *pose)) solved_.rows.push_back({pose});
    }
    bool final = false;
    double damping = 1e-4;
    for (solved_.rounds = 0; solved_.rounds < kMaxRounds; ++solved_.rounds) {
      linearise();
      set_noise();
      set_weights(final);
      const UnknownVector right = normal_equations();
      const double cost = cost_of(solved_.state);
      bool took = false;
      double moved = 0.0;
      while (damping < 1e8) {
        UnknownMatrix damped = solved_.information;
        damped.diagonal() *= 1.0 + damping;
        const UnknownVector step = solve_active(damped, right, solved_.active);
        if (!step.allFinite()) break;
        const ArmState next = solved_.state.moved(step);
        if (cost_of(next) <= cost) {
          solved_.state = next;
          moved_ += step.head<14>();
          moved = std::sqrt(std::abs(step.dot(solved_.information * step)) /
                            static_cast<double>(unknown::kCount));
          damping = std::max(1e-9, 0.2 * damping);
          took = true;
          break;
        }
        damping *= 8.0;
      }
      // A hundredth of a standard error is nothing any more.
      if (!took || moved < 0.01) {
        if (final) break;
        final = true;
        damping = 1e-6;
      }
    }
    linearise();
    set_noise();
    set_weights(true);
    normal_equations();
    return std::move(solved_);
  }

 private:
  void linearise() {
    const UnknownVector h = difference_steps();
    for (FitRow& row : solved_.rows) {
      row.residual = residual_of(solved_.state, rig_, *row.seen).value_or(PoseResidual::Zero());
    }
    for (int i = 0; i < unknown::kCount; ++i) {
      if (!solved_.active[static_cast<std::size_t>(i)]) continue;
      UnknownVector step = UnknownVector::Zero();
      step[i] = h[i];
      const ArmState above = solved_.state.moved(step);
      const ArmState below = solved_.state.moved(-step);
      for (FitRow& row : solved_.rows) {
        const auto high = residual_of(above, rig_, *row.seen);
        const auto low = residual_of(below, rig_, *row.seen);
        // At the ends of a gap one side has no pose.
        if (high && low) {
          row.jacobian.col(i) = (*high - *low) / (2.0 * h[i]);
        } else {
          row.jacobian.col(i).setZero();
        }
      }
    }
  }

  void set_noise() {
    std::vector<double> position;
    std::vector<double> turn;
    for (const FitRow& row : solved_.rows) {
      position.push_back(row.residual.head<3>().norm());
      if (row.seen->orientation) turn.push_back(row.residual.tail<3>().norm());
    }
    solved_.noise_mm = std::max(kMinNoiseMm, median(position) / kMedianOfThree);
    solved_.noise_rad = std::max(kMinNoiseRad, median(turn) / kMedianOfThree);
  }

  void set_weights(bool final) {
    for (FitRow& row : solved_.rows) {
      const double position = row.residual.head<3>().norm() / solved_.noise_mm;
      const double turn = row.residual.tail<3>().norm() / solved_.noise_rad;
      row.position_weight = final ? tukey(position) : soft_l1(position);
      row.turn_weight = row.seen->orientation ? (final ? tukey(turn) : soft_l1(turn)) : 0.0;
    }
  }

  UnknownVector normal_equations() {
    solved_.information.setZero();
    UnknownVector right = UnknownVector::Zero();
    const double position = 1.0 / (solved_.noise_mm * solved_.noise_mm);
    const double turn = 1.0 / (solved_.noise_rad * solved_.noise_rad);
    for (const FitRow& row : solved_.rows) {
      const auto jp = row.jacobian.topRows<3>();
      const auto jt = row.jacobian.bottomRows<3>();
      if (row.position_weight > 0.0) {
        solved_.information.noalias() += (position * row.position_weight) * (jp.transpose() * jp);
        right.noalias() -= (position * row.position_weight) * (jp.transpose() * row.residual.head<3>());
      }
      if (row.turn_weight > 0.0) {
        solved_.information.noalias() += (turn * row.turn_weight) * (jt.transpose() * jt);
        right.noalias() -= (turn * row.turn_weight) * (jt.transpose() * row.residual.tail<3>());
      }
    }
    solved_.information.diagonal() += solved_.prior_information;
    right.head<14>() -= solved_.prior_information.head<14>().cwiseProduct(moved_);
    return right;
  }

  /// Cost with the weights as they are: what one step is to make smaller.
  double cost_of(const ArmState& state) const {
    double cost = 0.0;
    for (const FitRow& row : solved_.rows) {
      const PoseResidual r = residual_of(state, rig_, *row.seen).value_or(row.residual);
      cost += row.position_weight * r.head<3>().squaredNorm() / (solved_.noise_mm * solved_.noise_mm) +
              row.turn_weight * r.tail<3>().squaredNorm() / (solved_.noise_rad * solved_.noise_rad);
    }
    Eigen::Matrix<double, 14, 1> off;
    off.head<3>() = state.arm.joint_gain - state.nominal.joint_gain;
    off.segment<3>(3) = state.arm.joint_offset_rad - state.nominal.joint_offset_rad;
    off[6] = state.arm.first_link_mm - state.nominal.first_link_mm;
    off[7] = state.arm.second_link_mm - state.nominal.second_link_mm;
    off.segment<3>(8) = state.arm.gimbal_gain - state.nominal.gimbal_gain;
    off.tail<3>() = state.arm.gimbal_offset_rad - state.nominal.gimbal_offset_rad;
    return cost + off.cwiseAbs2().dot(solved_.prior_information.head<14>());
  }

  const RigStream& rig_;
  Solved solved_;
  Eigen::Matrix<double, 14, 1> moved_ = Eigen::Matrix<double, 14, 1>::Zero();  ///< from the nominal arm
};

std::vector<int> indices(const std::array<bool, unknown::kCount>& active) {
  std::vector<int> all;
  for (int i = 0; i < unknown::kCount; ++i) {
    if (active[static_cast<std::size_t>(i)]) all.push_back(i);
  }
  return all;
}

/// Scaled to a diagonal of ones: rad and mm side by side.
MatrixXd scaled(const UnknownMatrix& information, const std::vector<int>& of, VectorXd& scale) {
  const auto n = static_cast<Eigen::Index>(of.size());
  scale.resize(n);
  for (Eigen::Index i = 0; i < n; ++i) {
    const double d = information(of[static_cast<std::size_t>(i)], of[static_cast<std::size_t>(i)]);
    scale[i] = d > 0.0 ? 1.0 / std::sqrt(d) : 1.0;
  }
  MatrixXd m(n, n);
  for (Eigen::Index i = 0; i < n; ++i) {
    for (Eigen::Index k = 0; k < n; ++k) {
      m(i, k) =
          scale[i] * scale[k] * information(of[static_cast<std::size_t>(i)], of[static_cast<std::size_t>(k)]);
    }
  }
  return m;
}

}  // namespace

UnknownVector solve_active(const UnknownMatrix& information, const UnknownVector& right,
                           const std::array<bool, unknown::kCount>& active) {
  const std::vector<int> of = indices(active);
  VectorXd scale;
  const MatrixXd m = scaled(information, of, scale);
  VectorXd b(scale.size());
  for (Eigen::Index i = 0; i < b.size(); ++i) b[i] = scale[i] * right[of[static_cast<std::size_t>(i)]];
  const VectorXd x = linear_algebra::solve_symmetric(m, b);
  UnknownVector all = UnknownVector::Zero();
  for (Eigen::Index i = 0; i < b.size(); ++i) all[of[static_cast<std::size_t>(i)]] = scale[i] * x[i];
  return all;
}

UnknownMatrix inverse_active(const UnknownMatrix& information,
                             const std::array<bool, unknown::kCount>& active) {
  const std::vector<int> of = indices(active);
  VectorXd scale;
  const MatrixXd m = scaled(information, of, scale);
  const MatrixXd inverse = linear_algebra::invert_symmetric(m);
  UnknownMatrix all = UnknownMatrix::Zero();
  for (Eigen::Index i = 0; i < m.rows(); ++i) {
    for (Eigen::Index k = 0; k < m.rows(); ++k) {
      all(of[static_cast<std::size_t>(i)], of[static_cast<std::size_t>(k)]) =
          scale[i] * scale[k] * inverse(i, k);
    }
  }
  return all;
}

Solved solve_arm(const RigStream& rig, const std::vector<const ReferencePose*>& seen, const ArmState& start,
                 const std::array<bool, unknown::kCount>& active) {
  return Solver(rig, start, active).run(seen);
}

}  // namespace hapticd::calibration
