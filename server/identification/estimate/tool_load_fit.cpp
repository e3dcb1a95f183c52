#include "server/identification/estimate/tool_load_fit.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>

#include "server/linear_algebra/least_squares.h"

namespace hapticd::identification {

namespace {

using Matrix = Eigen::MatrixXd;
using Vector = Eigen::VectorXd;
constexpr int kZ = static_cast<int>(ToolMoments::kRegressors);
constexpr int kY = 6;
constexpr int kP = 16;
constexpr double kInfinite = std::numeric_limits<double>::infinity();
constexpr double kTurningEnough = 1.0;  // rad/s², rms: below, it is the gimbal's noise that turns

/// Place of the regressor that is 1.
constexpr int kOne = 3;

// Places in the vector of parameters.
constexpr int kMass = 0, kTurn = 1, kForceBias = 4, kArm = 7, kCentre = 10, kTorqueBias = 13;

struct Theta {
  double mass = 0.0;  // g
  Eigen::Matrix3d rotation = Eigen::Matrix3d::Identity();
  Eigen::Vector3d force_bias = Eigen::Vector3d::Zero(), arm = Eigen::Vector3d::Zero(),
                  centre = Eigen::Vector3d::Zero(), torque_bias = Eigen::Vector3d::Zero();

  Theta moved(const Vector& step) const {
    Theta next = *this;
    next.mass += step(kMass);
    const Eigen::Vector3d turn = step.segment<3>(kTurn);
    const double angle = turn.norm();
    if (angle > 0.0) next.rotation = rotation * Eigen::AngleAxisd(angle, turn / angle).toRotationMatrix();
    next.force_bias += step.segment<3>(kForceBias);
    next.arm += step.segment<3>(kArm);
    next.centre += step.segment<3>(kCentre);
    next.torque_bias += step.segment<3>(kTorqueBias);
    return next;
  }

  /// Coefficients of both readings, linear in the regressors: six rows.
  Matrix coefficients() const {
    Matrix c = Matrix::Zero(kY, kZ);
    Matrix tool = Matrix::Zero(3, kZ);  // force on the tool, its own frame
    tool.leftCols<3>() = mass * Eigen::Matrix3d::Identity();
    for (int i = 0; i < 3; ++i) {
      for (int j = 0; j < 3; ++j) tool(i, 4 + 3 * i + j) = -mass * arm(j);
    }
    Eigen::Matrix3d lever;
    lever << 0.0, -centre.z(), centre.y(), centre.z(), 0.0, -centre.x(), -centre.y(), centre.x(), 0.0;
    c.topRows<3>() = rotation.transpose() * tool;
    c.bottomRows<3>() = rotation.transpose() * lever * tool;
    c.block<3, 1>(0, 3) = force_bias;
    c.block<3, 1>(3, 3) = torque_bias;
    return c;
  }
};

struct Unpacked {
  Matrix zz{kZ, kZ}, zy{kZ, kY};
  Vector yy{kY};      // sums of squares
  Vector spread{kY};  // about the mean
  double samples = 0.0;
};

Unpacked unpack(const ToolMoments& moments) {
  Unpacked u;
  const auto at = [&](int i, int j) {
    const auto a = static_cast<std::size_t>(std::max(i, j));
    const auto b = static_cast<std::size_t>(std::min(i, j));
    return moments.products[a * (a + 1) / 2 + b];
  };
  for (int i = 0; i < kZ; ++i) {
    for (int j = 0; j < kZ; ++j) u.zz(i, j) = at(i, j);
    for (int j = 0; j < kY; ++j) u.zy(i, j) = at(i, kZ + j);
  }
  for (int j = 0; j < kY; ++j) {
    u.yy(j) = at(kZ + j, kZ + j);
    u.spread(j) = std::max(0.0, u.yy(j) - u.zy(kOne, j) * u.zy(kOne, j) / std::max(1.0, u.zz(kOne, kOne)));
  }
  u.samples = moments.samples;
  return u;
}

/// Sum of squares left in each of the six readings.
Vector left_of(const Unpacked& u, const Matrix& c) {
  Vector left(kY);
  for (int j = 0; j < kY; ++j) {
    const Vector row = c.row(j).transpose();
    left(j) = std::max(0.0, u.yy(j) - 2.0 * row.dot(u.zy.col(j)) + row.dot(u.zz * row));
  }
  return left;
}

struct Weights {
  double force = 1.0, torque = 0.0;  // one over a reading's variance
  double of(int row) const { return row < 3 ? force : torque; }
};

double cost(const Vector& left, const Weights& weights) {
  return weights.force * left.head<3>().sum() + weights.torque * left.tail<3>().sum();
}

/// Usual sizes. A parameter is held to where it is by thirty times its size, which keeps a parameter in place
/// that the data do not show.
Vector usual_sizes(double mass) {
  Vector s(kP);
  s << std::max(5.0, std::abs(mass)), 1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 50.0, 50.0, 50.0, 50.0, 50.0, 50.0, 20.0,
      20.0, 20.0;
  return s;
}
constexpr double kPriorSizes = 30.0;

linear_algebra::NormalEquations linearise(const Unpacked& u, const Theta& theta, const Weights& weights,
                                          bool turning) {
  const auto regressors_by_readings = [&](const Vector& step) {
    const Matrix c = theta.moved(step).coefficients().transpose();
    return Vector(c.reshaped());
  };
  Matrix slopes = linear_algebra::central_differences(regressors_by_readings, 1e-6 * usual_sizes(theta.mass));
  if (!turning) slopes.middleCols<3>(kArm).setZero();
  const Matrix c = theta.coefficients();
  linear_algebra::NormalEquations equations(kP);
  equations.cost = cost(left_of(u, c), weights);
  for (int j = 0; j < kY; ++j) {
    const double weight = weights.of(j);
    if (weight <= 0.0) continue;
    const auto d = slopes.middleRows<kZ>(j * kZ);
    equations.information += weight * d.transpose() * u.zz * d;
    equations.right += weight * d.transpose() * (u.zy.col(j) - u.zz * c.row(j).transpose());
  }
  return equations;
}

using Search = linear_algebra::Minimum<Theta>;

Search descend(const Unpacked& u, const Theta& start, const Weights& weights, bool turning) {
  const Vector prior = (kPriorSizes * usual_sizes(start.mass)).cwiseAbs2().cwiseInverse();
  return linear_algebra::minimise(
      start,
      [&](const Theta& theta) {
        linear_algebra::NormalEquations equations = linearise(u, theta, weights, turning);
        equations.information.diagonal() += prior;
        return equations;
      },
      [&](const Theta& theta) { return cost(left_of(u, theta.coefficients()), weights); },
      [](const Theta& theta, Vector step) {
        const double turn = step.segment<3>(kTurn).norm();
        if (turn > 0.7) step *= 0.7 / turn;  // rotations are not linear
        return theta.moved(step);
      });
}

/// Guesses the proper rotation and the mass nearest to the linear map from w to the force.
Theta guess(const Unpacked& u) {
  Theta theta;
  const double uncentred = std::max(1.0, u.zz(kOne, kOne));
  const Eigen::Matrix3d ww =
      u.zz.block<3, 3>(0, 0) - u.zz.block<3, 1>(0, kOne) * u.zz.block<3, 1>(0, kOne).transpose() / uncentred;
  const Eigen::Matrix3d wf =
      u.zy.block<3, 3>(0, 0) - u.zz.block<3, 1>(0, kOne) * u.zy.block<1, 3>(kOne, 0) / uncentred;
  // Orthogonal Procrustes: of f = m Rᵀ w, R maximises tr(R wf ᵀ)... by singular values.
  const linear_algebra::SingularValues3 svd = linear_algebra::singular_values(wf);
  Eigen::Matrix3d middle = Eigen::Matrix3d::Identity();
  middle(2, 2) = (svd.u * svd.v.transpose()).determinant();
  theta.rotation = svd.u * middle * svd.v.transpose();
  const double square = ww.trace();
  theta.mass = square > 0.0 ? std::max(0.0, (theta.rotation.transpose() * wf).trace() / square) : 0.0;
  return theta;
}

hal::Vector3 to_hal(const Eigen::Vector3d& v) {
  return {v.x(), v.y(), v.z()};
}
Eigen::Vector3d to_eigen(const hal::Vector3& v) {
  return {v.x, v.y, v.z};
}

}  // namespace

void ToolMoments::add(const ToolExcitation& e) noexcept {
  const auto& b = e.turning_n_per_g_mm;
  const std::array<double, kColumns> row{e.weight_n_per_g.x,
                                         e.weight_n_per_g.y,
                                         e.weight_n_per_g.z,
                                         1.0,
                                         b[0].x,
                                         b[0].y,
                                         b[0].z,
                                         b[1].x,
                                         b[1].y,
                                         b[1].z,
                                         b[2].x,
                                         b[2].y,
                                         b[2].z,
                                         e.force_n.x,
                                         e.force_n.y,
                                         e.force_n.z,
                                         e.torque_n_mm.x,
                                         e.torque_n_mm.y,
                                         e.torque_n_mm.z};
  std::size_t at = 0;
  for (std::size_t i = 0; i < kColumns; ++i) {
    for (std::size_t j = 0; j <= i; ++j) products[at++] += row[i] * row[j];
  }
  samples += 1.0;
  turning_square += e.turning_rad_per_s2 * e.turning_rad_per_s2;
}

void ToolMoments::add(const ToolMoments& other) noexcept {
  for (std::size_t i = 0; i < products.size(); ++i) products[i] += other.products[i];
  samples += other.samples;
  turning_square += other.turning_square;
}

ToolMoments ToolMoments::centred() const noexcept {
  const auto place = [](std::size_t i, std::size_t j) { return i * (i + 1) / 2 + j; };  // i ≥ j
  constexpr auto kOnes = static_cast<std::size_t>(kOne);
  const auto sum = [&](std::size_t i) {
    return i >= kOnes ? products[place(i, kOnes)] : products[place(kOnes, i)];
  };
  ToolMoments about = *this;
  if (!(samples > 0.0)) return about;
  for (std::size_t i = 0; i < kColumns; ++i) {
    for (std::size_t j = 0; j <= i; ++j) {
      double& product = about.products[place(i, j)];
      product = i == kOnes || j == kOnes ? 0.0 : product - sum(i) * sum(j) / samples;
    }
  }
  return about;
}

ToolLoadFit fit_tool_load(const ToolMoments& moments, const ToolLoadOptions& options) {
  ToolLoadFit fit;
  if (!(moments.samples >= 10.0)) return fit;
  for (const double product : moments.products) {
    if (!std::isfinite(product)) return fit;
  }
  const Unpacked u = unpack(moments);
  fit.has_torque = u.yy.tail<3>().sum() > 0.0;
  const bool turning =
      options.turning && std::sqrt(moments.turning_square / moments.samples) > kTurningEnough;

  Weights weights;
  weights.force = 1.0 / 4e-6;                          // 2 mN
  weights.torque = fit.has_torque ? 1.0 / 1e-2 : 0.0;  // 0.1 N·mm
  Theta given = guess(u);
  const Theta own = given;
  const hal::Quaternion& q = options.start;
  given.rotation = Eigen::Quaterniond(q.w, q.x, q.y, q.z).normalized().toRotationMatrix();
  // If both explain the data alike, the data do not determine the rotation: it stays as given.
  Search best = descend(u, given, weights, turning);
  const Search other = descend(u, own, weights, turning);
  const double alike = 1e-12 * cost(u.yy, weights);
  if (other.equations.cost < 0.99 * best.equations.cost - alike) best = other;
  for (int round = 0; round < 3; ++round) {
    if (round > 0) best = descend(u, best.state, weights, turning);
    const Vector left = left_of(u, best.state.coefficients());
    const double degrees = std::max(1.0, 3.0 * u.samples - 0.5 * kP);
    fit.force_rms_n = std::sqrt(left.head<3>().sum() / degrees);
    fit.torque_rms_n_mm = std::sqrt(left.tail<3>().sum() / degrees);
    // Exact data have residuals of rounding only; weights stay finite.
    weights.force = 1.0 / std::max(1e-14, fit.force_rms_n * fit.force_rms_n);
    if (fit.has_torque) weights.torque = 1.0 / std::max(1e-12, fit.torque_rms_n_mm * fit.torque_rms_n_mm);
    const double varied = u.spread.head<3>().sum();
    fit.residual = varied > 0.0 ? std::sqrt(left.head<3>().sum() / varied) : 0.0;
  }
  best = descend(u, best.state, weights, turning);
  if (!std::isfinite(best.equations.cost)) return fit;

  const Vector sizes = usual_sizes(best.state.mass);
  const Matrix scaled = sizes.asDiagonal() * best.equations.information * sizes.asDiagonal();
  const linear_algebra::SymmetricEigen eigen = linear_algebra::symmetric_eigen(scaled);
  // With exact data rounding is all that is left in a direction that the data do not determine.
  const double rounding = 1e-13 * eigen.values.maxCoeff();
  Vector error(kP);
  for (int p = 0; p < kP; ++p) {
    double variance = 0.0;
    for (int i = 0; i < kP; ++i) {
      const double share = eigen.vectors(p, i);
      const double reported = eigen.values(i);
      if (reported > rounding) {
        variance += share * share / reported;
      } else if (std::abs(share) > 1e-6) {
        variance = kInfinite;
      }
    }
    error(p) = std::sqrt(variance);
    const double most = p >= kTurn && p < kTurn + 3 ? 0.5 : p == kMass ? 1.0 : 3.0;
    const bool no_arm = !turning && p >= kArm && p < kArm + 3;
    const bool no_torque = !fit.has_torque && p >= kCentre;
    error(p) = !(error(p) < most) || no_arm || no_torque ? kInfinite : error(p) * sizes(p);
  }
  const Theta& t = best.state;
  fit.mass_g = t.mass;
  Eigen::Quaterniond rotation(t.rotation);
  rotation.normalize();
  if (rotation.w() < 0.0) rotation.coeffs() *= -1.0;
  fit.sensor_to_tool = {rotation.w(), rotation.x(), rotation.y(), rotation.z()};
  fit.force_bias_n = to_hal(t.force_bias);
  fit.torque_bias_n_mm = to_hal(t.torque_bias);
  fit.arm_mm = to_hal(t.arm);
  fit.centre_mm = to_hal(t.centre);
  fit.mass_error_g = error(kMass);
  fit.rotation_error_rad = to_hal(error.segment<3>(kTurn));
  fit.force_bias_error_n = to_hal(error.segment<3>(kForceBias));
  fit.arm_error_mm = to_hal(error.segment<3>(kArm));
  fit.centre_error_mm = to_hal(error.segment<3>(kCentre));
  fit.torque_bias_error_n_mm = to_hal(error.segment<3>(kTorqueBias));
  fit.good = std::isfinite(t.mass);
  return fit;
}

ToolLoadMisfit misfit(const ToolLoadFit& fit, const ToolMoments& moments) {
  ToolLoadMisfit result;
  if (!(moments.samples > 0.0)) return result;
  Theta theta;
  theta.mass = fit.mass_g;
  const hal::Quaternion& q = fit.sensor_to_tool;
  theta.rotation = Eigen::Quaterniond(q.w, q.x, q.y, q.z).toRotationMatrix();
  theta.force_bias = to_eigen(fit.force_bias_n);
  theta.arm = to_eigen(fit.arm_mm);
  theta.centre = to_eigen(fit.centre_mm);
  theta.torque_bias = to_eigen(fit.torque_bias_n_mm);
  const Vector left = left_of(unpack(moments), theta.coefficients());
  result.force_n2 = left.head<3>().sum() / (3.0 * moments.samples);
  result.torque_n2_mm2 = left.tail<3>().sum() / (3.0 * moments.samples);
  return result;
}

}  // namespace hapticd::identification
