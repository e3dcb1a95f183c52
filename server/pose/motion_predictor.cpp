#include "server/pose/motion_predictor.h"

#include <algorithm>
#include <cmath>

namespace hapticd::pose {

namespace {

/// Velocity that is missing after τ by an acceleration of 1, of a velocity that is `lag_s` late.
double missed_by(double ahead_s, double lag_s) noexcept {
  return ahead_s * (0.5 * ahead_s + lag_s);
}

Eigen::Quaterniond turned(const Eigen::Quaterniond& q, const Eigen::Vector3d& turn_rad) noexcept {
  const double half = 0.5 * turn_rad.norm();
  const double scale = half > 1e-8 ? 0.5 * std::sin(half) / half : 0.5;
  const Eigen::Vector3d axis = scale * turn_rad;
  return (Eigen::Quaterniond(std::cos(half), axis.x(), axis.y(), axis.z()) * q).normalized();
}

double angle_between(const Eigen::Quaterniond& a, const Eigen::Quaterniond& b) noexcept {
  const Eigen::Quaterniond between = a.conjugate() * b;
  return 2.0 * std::atan2(between.vec().norm(), std::abs(between.w()));
}

}  // namespace

MotionPredictor::MotionPredictor(double resolution_mm) noexcept
    : position_noise_mm_(resolution_mm / std::sqrt(12.0)) {
  restart();
}

void MotionPredictor::restart() noexcept {
  path_.forget();
  waiting_ = 0;
  acceleration_ = Eigen::Matrix3d::Identity() * (kPriorMmPerS2 * kPriorMmPerS2 / 3.0);
  angular_acceleration_ = kPriorRadPerS2 * kPriorRadPerS2;
}

void MotionPredictor::follow(const Now& now) noexcept {
  if (!now.position_mm.allFinite() || !now.orientation.coeffs().allFinite() ||
      !now.angular_rad_per_s.allFinite()) {
    return;
  }
  const double step_s = 1e-9 * static_cast<double>(now.time_ns - now_.time_ns);
  if (!begun_ || step_s < 0.0 || step_s > TipMotion::kMaxGapS) {
    restart();
    next_guess_ns_ = now.time_ns;
    last_score_ns_ = now.time_ns;
    begun_ = true;
  }
  now_ = now;
  path_.follow(now.position_mm, now.time_ns);
  score(now);
  if (now.time_ns >= next_guess_ns_) {
    guess();
    next_guess_ns_ = now.time_ns + static_cast<std::int64_t>(1e9 * kScoreEveryS);
  }
}

void MotionPredictor::guess() noexcept {
  const TipMotion::Velocity velocity = path_.velocity();
  if (!velocity.known) return;
  if (waiting_ == guesses_.size()) {
    first_ = (first_ + 1) % guesses_.size();
    --waiting_;
  }
  const PredictedMotion there = ahead(kScoreAheadS);
  guesses_[(first_ + waiting_) % guesses_.size()] = {
      now_.time_ns + static_cast<std::int64_t>(1e9 * kScoreAheadS), kScoreAheadS, velocity.lag_s,
      there.position_mm, there.orientation};
  ++waiting_;
}

void MotionPredictor::score(const Now& now) noexcept {
  while (waiting_ > 0 && guesses_[first_].due_ns <= now.time_ns) {
    const Guess& due = guesses_[first_];
    // A late tick: the guess was for an instant between two.
    const double late_s = 1e-9 * static_cast<double>(now.time_ns - due.due_ns);
    const Eigen::Vector3d missed_mm =
        path_.position_mm(due.due_ns).value_or(now.position_mm) - due.position_mm;
    const double scale = 1.0 / missed_by(due.ahead_s, due.lag_s);
    const Eigen::Vector3d acceleration = missed_mm * scale;
    const double angular =
        angle_between(due.orientation, now.orientation) / missed_by(due.ahead_s + late_s, kAngularLagS);
    const double passed_s = 1e-9 * static_cast<double>(now.time_ns - last_score_ns_);
    const double share = -std::expm1(-std::max(passed_s, kScoreEveryS) / kMemoryS);
    acceleration_ += share * (acceleration * acceleration.transpose() - acceleration_);
    angular_acceleration_ += share * (angular * angular - angular_acceleration_);
    last_score_ns_ = now.time_ns;
    first_ = (first_ + 1) % guesses_.size();
    --waiting_;
  }
}

PredictedMotion MotionPredictor::ahead(double ahead_s) const noexcept {
  PredictedMotion there;
  there.position_mm = now_.position_mm;
  there.orientation = now_.orientation;
  there.normal_is_held = now_.normal.has_value();
  if (!(ahead_s > 0.0)) return there;
  const double s = std::min(ahead_s, kMaxAheadS);
  const TipMotion::Velocity velocity = path_.velocity();
  Eigen::Vector3d mm_per_s = velocity.mm_per_s;
  if (now_.normal) mm_per_s -= *now_.normal * now_.normal->dot(mm_per_s);
  there.position_mm += mm_per_s * s;
  there.orientation = turned(now_.orientation, now_.angular_rad_per_s * s);

  const double missed = missed_by(s, velocity.lag_s);
  const double noise_mm = velocity.noise_per_mm * position_noise_mm_ * s;
  there.covariance_mm2 = missed * missed * acceleration_ + noise_mm * noise_mm * Eigen::Matrix3d::Identity();
  there.error_mm = std::sqrt(there.covariance_mm2.trace());
  there.error_bound_mm = kAssumedMmPerS2 * missed + 3.0 * std::sqrt(3.0) * noise_mm;
  // Held in contact: it may go on along the normal as well.
  if (now_.normal) there.error_bound_mm += std::abs(now_.normal->dot(velocity.mm_per_s)) * s;
  there.error_rad = std::sqrt(angular_acceleration_) * missed_by(s, kAngularLagS);
  return there;
}

}  // namespace hapticd::pose
