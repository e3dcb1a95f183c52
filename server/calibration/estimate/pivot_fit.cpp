#include "server/calibration/estimate/pivot_fit.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <map>

#include "rt/arm/rigid_transform.h"
#include "server/calibration/estimate/median.h"
#include "server/linear_algebra/least_squares.h"

namespace hapticd::calibration {

namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;
using Matrix6 = Eigen::Matrix<double, 6, 6>;
using Vector6 = Eigen::Matrix<double, 6, 1>;
using Row = Eigen::Matrix<double, 3, 6>;

constexpr double kMinTiltDeg = 8.0;
constexpr double kMaxErrorMm = 0.5;
constexpr double kMaxOutlierShare = 0.3;

hal::Error tip_refusal(std::string what, std::string value, std::string limit, std::string remedy) {
  return {std::move(what), "tip calibration", std::move(value), std::move(limit), std::move(remedy)};
}

double tilt_deg(const std::vector<ReferencePose>& poses) {
  const Eigen::Quaterniond first = *poses[poses.size() / 2].orientation;
  Vector3d mean = Vector3d::Zero();
  std::vector<Vector3d> turns;
  for (const ReferencePose& p : poses) {
    turns.push_back(rt::turn_of(first.conjugate() * *p.orientation));
    mean += turns.back() / static_cast<double>(poses.size());
  }
  Matrix3d spread = Matrix3d::Zero();
  for (const Vector3d& t : turns)
    spread += (t - mean) * (t - mean).transpose() / static_cast<double>(turns.size());
  return rt::kDegPerRad * std::sqrt(std::max(0.0, linear_algebra::symmetric_eigen(spread).values[1]));
}

}  // namespace

hal::Result<PivotFit> fit_pivot(const std::vector<ReferencePose>& poses, const Callback<bool()>& given_up) {
  if (poses.size() < kMinReferencePoses) {
    return tip_refusal("too few poses", std::to_string(poses.size()), "at least 40",
                       "turn the tool for longer");
  }
  for (const ReferencePose& p : poses) {
    if (!p.orientation) {
      return tip_refusal("the tracker sends no orientation", "", "poses with orientation",
                         "use a body of three markers or more");
    }
  }
  PivotFit fit;
  fit.poses = poses.size();
  fit.tilt_deg = tilt_deg(poses);
  if (fit.tilt_deg < kMinTiltDeg) {
    return tip_refusal("the tool turned too little",
                       fmt::format("{:.1f}°, standard deviation about its second axis", fit.tilt_deg),
                       "at least 8°",
                       "keep the tip in its hollow and lean the tool to all sides, by 30° and more");
  }
  std::vector<Row> rows;
  for (const ReferencePose& p : poses) {
    Row row;
    row << p.orientation->toRotationMatrix(), -Matrix3d::Identity();
    rows.push_back(row);
  }
  std::vector<double> weights(poses.size(), 1.0);
  Vector6 x = Vector6::Zero();
  linear_algebra::NormalEquations equations(6);
  double noise_mm = 1.0;
  for (int round = 0; round < 30; ++round) {
    if (given_up()) return tip_refusal("the fit was given up", "", "", "start again");
    equations = linear_algebra::NormalEquations(6);
    for (std::size_t i = 0; i < poses.size(); ++i) equations.add(rows[i], poses[i].position_mm, weights[i]);
    x = linear_algebra::solve_scaled(equations.information, equations.right);
    std::vector<double> sizes;
    for (std::size_t i = 0; i < poses.size(); ++i)
      sizes.push_back((rows[i] * x + poses[i].position_mm).norm());
    noise_mm = std::max(1e-6, median(sizes) / kMedianOfThree);
    for (std::size_t i = 0; i < poses.size(); ++i) {
      const double size = sizes[i] / noise_mm;
      weights[i] =
          round < 5 ? linear_algebra::soft_l1(size) : linear_algebra::tukey(size, kOutlierDeviations);
    }
  }
  std::map<long, Vector6> seconds;
  double squares = 0.0;
  for (std::size_t i = 0; i < poses.size(); ++i) {
    const Vector3d r = rows[i] * x + poses[i].position_mm;
    Vector6& score =
        seconds.try_emplace(std::lround(std::floor(poses[i].stamp_s)), Vector6::Zero()).first->second;
    score += weights[i] / (noise_mm * noise_mm) * rows[i].transpose() * r;
    if (weights[i] < 0.3) {
      ++fit.outliers;
    } else {
      squares += r.squaredNorm();
    }
  }
  const Matrix6 inverse = linear_algebra::invert_scaled(equations.information / (noise_mm * noise_mm));
  Matrix6 spread = Matrix6::Zero();
  for (const auto& [second, score] : seconds) spread += score * score.transpose();
  const double agree = seconds.size() < 5 ? 1.0 : std::max(1.0, (inverse * spread).trace() / 6.0);
  fit.tip_in_marker_mm = x.head<3>();
  fit.pivot_mm = x.tail<3>();
  fit.covariance_mm2 = agree * inverse.topLeftCorner<3, 3>();
  fit.residual_rms_mm =
      std::sqrt(squares / static_cast<double>(std::max<std::size_t>(1, fit.poses - fit.outliers)));
  const double error_mm = std::sqrt(fit.covariance_mm2.trace());
  if (!x.allFinite() || !(error_mm < kMaxErrorMm)) {
    return tip_refusal("the tip's place is not determined",
                       fmt::format("{:.2f} mm, standard error", error_mm), "0.5 mm",
                       "lean the tool further and to all sides, for longer");
  }
  if (static_cast<double>(fit.outliers) > kMaxOutlierShare * static_cast<double>(fit.poses)) {
    return tip_refusal("the tip did not stay where it was",
                       fmt::format("{} of {} poses do not fit", fit.outliers, fit.poses), "30 %",
                       "keep the tip in its hollow all the time");
  }
  return fit;
}

}  // namespace hapticd::calibration
