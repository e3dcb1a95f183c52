#include "server/calibration/estimate/left_out.h"

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <map>
#include <utility>

#include "server/calibration/estimate/median.h"
#include "server/linear_algebra/least_squares.h"

namespace hapticd::calibration {

namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

constexpr double kBlockS = 3.0;
constexpr int kTimeGroups = 5;
constexpr double kAgreementS = 1.0;
constexpr double kGoodWeight = 0.3;  ///< below: an outlier

struct Sums {
  UnknownMatrix information = UnknownMatrix::Zero();
  UnknownVector score = UnknownVector::Zero();
};

void add(const Solved& solved, const FitRow& row, Sums& sums) {
  const double position = row.position_weight / (solved.noise_mm * solved.noise_mm);
  const double turn = row.turn_weight / (solved.noise_rad * solved.noise_rad);
  const auto jp = row.jacobian.topRows<3>();
  const auto jt = row.jacobian.bottomRows<3>();
  sums.information.noalias() += position * (jp.transpose() * jp) + turn * (jt.transpose() * jt);
  sums.score.noalias() +=
      position * (jp.transpose() * row.residual.head<3>()) + turn * (jt.transpose() * row.residual.tail<3>());
}

/// Products of values some poses apart; and of themselves.
struct Neighbours {
  static constexpr std::size_t kApart = 8;
  using Product = Eigen::Matrix<double, 6, 6>;
  std::array<Product, kApart + 1> sum{};
  std::array<double, kApart + 1> count{};

  Neighbours() {
    for (Product& p : sum) p.setZero();
  }
  Product mean(std::size_t apart) const {
    return count[apart] > 0.0 ? Product(sum[apart] / count[apart]) : Product(Product::Zero());
  }
  /// What is alike at no distance: a parabola, level there, through all of them but the values' own.
  Product alike() const {
    double n = 0.0;
    double x = 0.0;
    double xx = 0.0;
    Product y = Product::Zero();
    Product xy = Product::Zero();
    for (std::size_t apart = 1; apart <= kApart; ++apart) {
      const auto square = static_cast<double>(apart * apart);
      n += 1.0;
      x += square;
      xx += square * square;
      y += mean(apart);
      xy += square * mean(apart);
    }
    return (xx * y - x * xy) / (n * xx - x * x);
  }
};

Neighbours neighbours(const std::vector<FitRow>& rows, const std::vector<PoseResidual>& values) {
  std::vector<double> steps;
  for (std::size_t i = 1; i < rows.size(); ++i)
    steps.push_back(rows[i].seen->stamp_s - rows[i - 1].seen->stamp_s);
  Neighbours n;
  if (steps.empty()) return n;
  const double step_s = median(std::move(steps));
  const auto good = [&rows](std::size_t i) {
    return rows[i].position_weight > kGoodWeight &&
           (!rows[i].seen->orientation || rows[i].turn_weight > kGoodWeight);
  };
  for (std::size_t i = 0; i < rows.size(); ++i) {
    if (!good(i)) continue;
    for (std::size_t apart = 0; apart <= Neighbours::kApart && i + apart < rows.size(); ++apart) {
      const double span_s = rows[i + apart].seen->stamp_s - rows[i].seen->stamp_s;
      if (!good(i + apart) || span_s > (static_cast<double>(apart) + 0.6) * step_s) continue;
      n.sum[apart] += values[i] * values[i + apart].transpose();
      n.count[apart] += 1.0;
    }
  }
  return n;
}

}  // namespace

std::vector<int> groups_by_time(const std::vector<FitRow>& rows) {
  std::vector<int> groups;
  for (const FitRow& row : rows) {
    const double block = std::floor((row.seen->stamp_s - rows.front().seen->stamp_s) / kBlockS);
    groups.push_back(static_cast<int>(block) % kTimeGroups);
  }
  return groups;
}

std::vector<int> groups_by_place(const ArmState& state, const RigStream& rig,
                                 const std::vector<FitRow>& rows) {
  std::vector<Vector3d> places;
  for (const FitRow& row : rows) {
    const auto pose = rig.at(state.rig_time_s(row.seen->stamp_s));
    places.push_back(pose ? pose->tip_mm : Vector3d::Zero());
  }
  Vector3d middle;
  for (int axis = 0; axis < 3; ++axis) {
    std::vector<double> values;
    for (const Vector3d& p : places) values.push_back(p[axis]);
    middle[axis] = median(std::move(values));
  }
  std::vector<int> groups;
  for (const Vector3d& p : places) {
    groups.push_back((p.x() > middle.x() ? 1 : 0) + (p.y() > middle.y() ? 2 : 0) +
                     (p.z() > middle.z() ? 4 : 0));
  }
  return groups;
}

LeftOut leave_out(const Solved& solved, const RigStream& rig, const std::vector<int>& groups) {
  std::map<int, Sums> sums;
  for (std::size_t i = 0; i < solved.rows.size(); ++i) add(solved, solved.rows[i], sums[groups[i]]);
  std::map<int, ArmState> states;
  for (const auto& [group, of_group] : sums) {
    const UnknownVector step =
        linear_algebra::solve_scaled(solved.information - of_group.information, of_group.score);
    states.emplace(group, step.allFinite() ? solved.state.moved(step) : solved.state);
  }
  std::vector<PoseResidual> marker;
  std::vector<PoseResidual> tip;
  double squares = 0.0;
  double count = 0.0;
  for (std::size_t i = 0; i < solved.rows.size(); ++i) {
    const ArmState& without = states.at(groups[i]);
    const FitRow& row = solved.rows[i];
    marker.push_back(residual_of(without, rig, *row.seen).value_or(row.residual));
    tip.push_back(target_residual_of(without, rig, *row.seen).value_or(PoseResidual::Zero()));
    if (row.position_weight <= kGoodWeight) continue;
    squares += marker.back().head<3>().squaredNorm();
    count += 1.0;
  }
  LeftOut left;
  left.rms_mm = count > 0.0 ? std::sqrt(squares / count) : 0.0;
  const Neighbours of_tip = neighbours(solved.rows, tip);
  const auto alike = of_tip.alike();
  left.alike_mm2 = alike.topLeftCorner<3, 3>();
  left.alike_turn_rad2 = alike.bottomRightCorner<3, 3>().trace();
  const Neighbours of_marker = neighbours(solved.rows, marker);
  const auto noise = Eigen::Matrix<double, 6, 6>(of_marker.mean(0) - of_marker.alike());
  left.noise_mm = std::sqrt(std::max(0.0, noise.topLeftCorner<3, 3>().trace() / 3.0));
  left.noise_rad = std::sqrt(std::max(0.0, noise.bottomRightCorner<3, 3>().trace() / 3.0));
  return left;
}

double agreement(const Solved& solved) {
  std::map<int, Sums> seconds;
  for (const FitRow& row : solved.rows) {
    const double second = (row.seen->stamp_s - solved.rows.front().seen->stamp_s) / kAgreementS;
    add(solved, row, seconds[static_cast<int>(second)]);
  }
  if (seconds.size() < 10) return 1.0;
  UnknownMatrix spread = UnknownMatrix::Zero();
  for (const auto& [second, sums] : seconds) spread += sums.score * sums.score.transpose();
  UnknownMatrix data = solved.information;
  data.diagonal() -= solved.prior_information;
  const auto n = static_cast<double>(std::count(solved.active.begin(), solved.active.end(), true));
  const auto blocks = static_cast<double>(seconds.size());
  const double ratio = (linear_algebra::invert_scaled(solved.information) * spread).trace() / n;
  return std::max(1.0, ratio * blocks / std::max(1.0, blocks - n / 3.0));
}

}  // namespace hapticd::calibration
