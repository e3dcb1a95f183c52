#include "server/calibration/estimate/arm_solver.h"

#include <Eigen/Core>
#include <algorithm>
#include <limits>

#include "server/calibration/estimate/median.h"
#include "server/linear_algebra/least_squares.h"

namespace hapticd::calibration {

namespace {

constexpr int kMaxRounds = 40;
/// A hundredth of a standard error of each unknown: a descent ends there.
constexpr double kMinGain = 1e-4 * unknown::kCount;
constexpr int kArmUnknowns = unknown::kRotation;
using ArmVector = Eigen::Matrix<double, kArmUnknowns, 1>;
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

class Solver {
 public:
  Solver(const RigStream& rig, const ArmState& start, const std::array<bool, unknown::kCount>& active,
         const Callback<bool()>& given_up)
      : rig_(rig), given_up_(given_up) {
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
    for (const bool final : {false, true}) {
      solved_.state = linear_algebra::minimise(
                          solved_.state,
                          [&](const ArmState& state) {
                            linearise(state);
                            set_noise();
                            set_weights(final);
                            auto equations = normal_equations(state);
                            // A descent ends with a cost that is not finite.
                            if (given_up_()) equations.cost = std::numeric_limits<double>::quiet_NaN();
                            return equations;
                          },
                          [&](const ArmState& state) { return cost_of(state); },
                          [](const ArmState& state, const UnknownVector& step) { return state.moved(step); },
                          {.gain_share = 0.0, .gain = kMinGain, .max_iterations = kMaxRounds})
                          .state;
    }
    return std::move(solved_);
  }

 private:
  void linearise(const ArmState& state) {
    const UnknownVector h = difference_steps();
    for (FitRow& row : solved_.rows) {
      row.residual = residual_of(state, rig_, *row.seen).value_or(PoseResidual::Zero());
    }
    for (int i = 0; i < unknown::kCount; ++i) {
      if (!solved_.active[static_cast<std::size_t>(i)]) continue;
      if (given_up_()) return;
      UnknownVector step = UnknownVector::Zero();
      step[i] = h[i];
      const ArmState above = state.moved(step);
      const ArmState below = state.moved(-step);
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
    const auto weight_of = [final](double s) {
      return final ? linear_algebra::tukey(s, kOutlierDeviations) : linear_algebra::soft_l1(s);
    };
    for (FitRow& row : solved_.rows) {
      const double position = row.residual.head<3>().norm() / solved_.noise_mm;
      const double turn = row.residual.tail<3>().norm() / solved_.noise_rad;
      row.position_weight = weight_of(position);
      row.turn_weight = row.seen->orientation ? weight_of(turn) : 0.0;
    }
  }

  linear_algebra::NormalEquations normal_equations(const ArmState& state) {
    linear_algebra::NormalEquations equations(unknown::kCount);
    const double position = 1.0 / (solved_.noise_mm * solved_.noise_mm);
    const double turn = 1.0 / (solved_.noise_rad * solved_.noise_rad);
    for (const FitRow& row : solved_.rows) {
      equations.add(row.jacobian.topRows<3>(), row.residual.head<3>(), position * row.position_weight);
      if (row.turn_weight > 0.0) {
        equations.add(row.jacobian.bottomRows<3>(), row.residual.tail<3>(), turn * row.turn_weight);
      }
    }
    const ArmVector off = off_nominal(state);
    const auto prior = solved_.prior_information.head<kArmUnknowns>();
    equations.information.diagonal() += solved_.prior_information;
    equations.right.head<kArmUnknowns>() -= prior.cwiseProduct(off);
    equations.cost += off.cwiseAbs2().dot(prior);
    solved_.information = equations.information;
    return equations;
  }

  /// Cost with the weights as they are: what one step is to make smaller.
  double cost_of(const ArmState& state) const {
    double cost = 0.0;
    for (const FitRow& row : solved_.rows) {
      const PoseResidual r = residual_of(state, rig_, *row.seen).value_or(row.residual);
      cost += row.position_weight * r.head<3>().squaredNorm() / (solved_.noise_mm * solved_.noise_mm) +
              row.turn_weight * r.tail<3>().squaredNorm() / (solved_.noise_rad * solved_.noise_rad);
    }
    return cost + off_nominal(state).cwiseAbs2().dot(solved_.prior_information.head<kArmUnknowns>());
  }

  static ArmVector off_nominal(const ArmState& state) {
    ArmVector off;
    off.head<3>() = state.arm.joint_gain - state.nominal.joint_gain;
    off.segment<3>(3) = state.arm.joint_offset_rad - state.nominal.joint_offset_rad;
    off[6] = state.arm.first_link_mm - state.nominal.first_link_mm;
    off[7] = state.arm.second_link_mm - state.nominal.second_link_mm;
    off.segment<3>(8) = state.arm.gimbal_gain - state.nominal.gimbal_gain;
    off.tail<3>() = state.arm.gimbal_offset_rad - state.nominal.gimbal_offset_rad;
    return off;
  }

  const RigStream& rig_;
  const Callback<bool()>& given_up_;
  Solved solved_;
};

}  // namespace

Solved solve_arm(const RigStream& rig, const std::vector<const ReferencePose*>& seen, const ArmState& start,
                 const std::array<bool, unknown::kCount>& active, const Callback<bool()>& given_up) {
  return Solver(rig, start, active, given_up).run(seen);
}

}  // namespace hapticd::calibration
