#include "server/calibration/estimate/rigid_fit.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstddef>

#include "server/calibration/estimate/median.h"
#include "server/linear_algebra/least_squares.h"

namespace hapticd::calibration {

namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

constexpr std::size_t kSample = 8;
constexpr int kSamples = 40;
constexpr std::size_t kMaxPairs = 600;
constexpr int kRounds = 60;

std::vector<double> residuals_mm(const std::vector<MarkerPair>& pairs, const RigidFit& fit) {
  std::vector<double> r;
  r.reserve(pairs.size());
  for (const MarkerPair& p : pairs) {
    const Vector3d model = fit.scale * (fit.transform.rotation * (p.tip_mm + p.tool * fit.marker_mm));
    r.push_back((p.seen_mm - model - fit.transform.translation_mm).norm() / fit.scale);
  }
  return r;
}

/// Finds rotation and scale for the marker, then the marker for them, in turn.
std::optional<RigidFit> alternate(const std::vector<MarkerPair>& pairs, const std::vector<double>& weights,
                                  bool with_scale, RigidFit fit, int rounds) {
  std::vector<Vector3d> from(pairs.size());
  std::vector<Vector3d> onto(pairs.size());
  for (std::size_t i = 0; i < pairs.size(); ++i) onto[i] = pairs[i].seen_mm;
  for (int round = 0; round < rounds; ++round) {
    for (std::size_t i = 0; i < pairs.size(); ++i) from[i] = pairs[i].tip_mm + pairs[i].tool * fit.marker_mm;
    const auto turned = umeyama(from, onto, weights, with_scale);
    if (!turned) return std::nullopt;
    linear_algebra::NormalEquations equations(6);
    const Matrix3d back = turned->transform.rotation.toRotationMatrix().transpose() / turned->scale;
    for (std::size_t i = 0; i < pairs.size(); ++i) {
      Eigen::Matrix<double, 3, 6> row;
      row << pairs[i].tool, Matrix3d::Identity();
      equations.add(row, pairs[i].tip_mm - back * pairs[i].seen_mm, weights[i]);
    }
    // A tool that hardly turns does not say where its marker is: near the tip, then.
    double total = 0.0;
    for (const double w : weights) total += w;
    equations.information.topLeftCorner<3, 3>() += 1e-4 * total * Matrix3d::Identity();
    const Eigen::VectorXd solved = linear_algebra::solve_scaled(equations.information, equations.right);
    fit = *turned;
    fit.marker_mm = solved.head<3>();
    fit.transform.translation_mm = fit.scale * (fit.transform.rotation * Vector3d(solved.tail<3>()));
    if (!solved.allFinite()) return std::nullopt;
  }
  return fit;
}

}  // namespace

std::optional<RigidFit> umeyama(const std::vector<Vector3d>& from, const std::vector<Vector3d>& onto,
                                const std::vector<double>& weights, bool with_scale) {
  Vector3d from_mean = Vector3d::Zero();
  Vector3d onto_mean = Vector3d::Zero();
  double total = 0.0;
  for (std::size_t i = 0; i < from.size(); ++i) {
    from_mean += weights[i] * from[i];
    onto_mean += weights[i] * onto[i];
    total += weights[i];
  }
  if (!(total > 0.0)) return std::nullopt;
  from_mean /= total;
  onto_mean /= total;
  Matrix3d product = Matrix3d::Zero();
  double spread = 0.0;
  for (std::size_t i = 0; i < from.size(); ++i) {
    product += weights[i] * (onto[i] - onto_mean) * (from[i] - from_mean).transpose();
    spread += weights[i] * (from[i] - from_mean).squaredNorm();
  }
  const auto [u, s, v] = linear_algebra::singular_values(product);
  if (!s.allFinite() || !(s[1] > 1e-6 * s[0]) || !(spread > 0.0)) return std::nullopt;
  Vector3d sign = Vector3d::Ones();
  if (u.determinant() * v.determinant() < 0.0) sign.z() = -1.0;
  RigidFit fit;
  const Matrix3d rotation = u * sign.asDiagonal() * v.transpose();
  fit.transform.rotation = Eigen::Quaterniond(rotation).normalized();
  fit.scale = with_scale ? s.dot(sign) / spread : 1.0;
  if (!(fit.scale > 0.0)) return std::nullopt;
  fit.transform.translation_mm = onto_mean - fit.scale * rotation * from_mean;
  return fit;
}

std::optional<RigidFit> fit_rigid(const std::vector<MarkerPair>& given, bool mirrored, bool with_scale) {
  if (given.size() < 12) return std::nullopt;
  std::vector<MarkerPair> pairs;
  const std::size_t stride = 1 + (given.size() - 1) / kMaxPairs;
  for (std::size_t i = 0; i < given.size(); i += stride) {
    pairs.push_back(given[i]);
    if (mirrored) pairs.back().seen_mm.x() = -pairs.back().seen_mm.x();
  }
  std::optional<RigidFit> best;
  std::uint64_t word = 0x9e3779b97f4a7c15ULL;
  for (int trial = 0; trial < kSamples; ++trial) {
    std::vector<MarkerPair> sample;
    for (std::size_t i = 0; i < kSample; ++i) {
      word = word * 6364136223846793005ULL + 1442695040888963407ULL;
      sample.push_back(pairs[(word >> 33) % pairs.size()]);
    }
    auto fit = alternate(sample, std::vector<double>(kSample, 1.0), with_scale, {}, 8);
    if (!fit) continue;
    fit->median_residual_mm = median(residuals_mm(pairs, *fit));
    if (!best || fit->median_residual_mm < best->median_residual_mm) best = fit;
  }
  if (!best) return std::nullopt;
  for (int round = 0; round < kRounds; ++round) {
    const std::vector<double> r = residuals_mm(pairs, *best);
    const double level = std::max(1e-9, 1.5 * median(r));
    std::vector<double> weights;
    for (const double residual : r) weights.push_back(1.0 / (1.0 + std::pow(residual / level, 4)));
    const auto fit = alternate(pairs, weights, with_scale, *best, 1);
    if (!fit) return std::nullopt;
    best = fit;
  }
  best->median_residual_mm = median(residuals_mm(pairs, *best));
  return best;
}

}  // namespace hapticd::calibration
