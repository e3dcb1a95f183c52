#pragma once

#include <Eigen/Dense>

namespace hapticd::study {

/// Kalman filter on positions with its gain at rest, the α-β-γ filter: position, velocity and acceleration
/// are carried on over the tick, x = F x + g w with g = (T²/2, T, 1), and corrected by x⁺ = x⁻ + K (y - x⁻),
/// where K is the limit of the Riccati recursion. A candidate that hapticd does not ship.
class SteadyStateKalman {
 public:
  /// `position_deviation_mm`: of a reading; an encoder's step / √12. `jump`: standard deviation of w, the
  /// acceleration's change from tick to tick, in mm/s².
  SteadyStateKalman(double position_deviation_mm, double jump, double rate_hz) {
    const double t = 1.0 / rate_hz;
    carry_ << 1.0, t, 0.5 * t * t, 0.0, 1.0, t, 0.0, 0.0, 1.0;
    const Eigen::Vector3d g(0.5 * t * t, t, 1.0);
    const double noise = position_deviation_mm * position_deviation_mm;
    Eigen::Matrix3d p = noise * Eigen::Matrix3d::Identity();
    constexpr int kMaxSteps = 100'000;
    for (int step = 0; step < kMaxSteps; ++step) {
      p = (carry_ * p * carry_.transpose() + jump * jump * g * g.transpose()).eval();
      const Eigen::Vector3d before = gain_;
      gain_ = p.col(0) / (p(0, 0) + noise);
      p -= gain_ * p.row(0).eval();
      if ((gain_ - before).cwiseQuotient(gain_).cwiseAbs().maxCoeff() < 1e-13) break;
    }
  }

  /// One tick. The first position is taken as it is, at rest.
  void update(double position_mm) noexcept {
    state_ = started_ ? Eigen::Vector3d(carry_ * state_) : Eigen::Vector3d(position_mm, 0.0, 0.0);
    started_ = true;
    state_ += gain_ * (position_mm - state_(0));
  }

  double velocity_mm_per_s() const noexcept { return state_(1); }
  double acceleration_mm_per_s2() const noexcept { return state_(2); }
  const Eigen::Vector3d& gain() const noexcept { return gain_; }

 private:
  bool started_ = false;
  Eigen::Matrix3d carry_;
  Eigen::Vector3d gain_ = Eigen::Vector3d::Zero();
  Eigen::Vector3d state_ = Eigen::Vector3d::Zero();
};

}  // namespace hapticd::study
