#include "rt/deformation/tracked_direction.h"

#include <algorithm>
#include <cmath>

#include "rt/signal/ticks.h"

namespace hapticd::rt {

namespace {
constexpr double kMinForceN = 1e-3;
}

TrackedDirection::TrackedDirection(const FrictionParameters& friction, double force_noise_n,
                                   double rate_hz) noexcept
    : friction_(friction),
      ticks_per_update_(ticks_of(kUpdateS, rate_hz)),
      period_s_(1.0 / rate_hz),
      force_variance_n2_(force_noise_n * force_noise_n),
      friction_state_(friction) {}

void TrackedDirection::begin(const hal::Vector3& reaction_n) noexcept {
  normal_ = direction_or(reaction_n, normal_);
  friction_n_ = {};
  gathered_ = 0;
  touching_s_ = 0.0;
  // The first reaction shows the normal, less whatever friction there is.
  const double force_n = std::max(norm(reaction_n), kMinForceN);
  const double friction_variance = 0.1 * friction_.kinetic * friction_.kinetic;
  friction_state_.begin(friction_variance);
  normal_variance_ = friction_variance + std::min(kFirstDeviationRad * kFirstDeviationRad,
                                                  kOnsetDisorder * force_variance_n2_ / (force_n * force_n));
}

void TrackedDirection::update(const hal::Vector3& reaction_n, const hal::Vector3& step_mm,
                              const hal::Vector3& velocity_mm_per_s, double periods) noexcept {
  gathered_periods_ = gathered_ == 0 ? periods : gathered_periods_ + periods;
  gathered_step_mm_ = gathered_ == 0 ? step_mm : gathered_step_mm_ + step_mm;
  gathered_n_ = gathered_ == 0 ? reaction_n : gathered_n_ + reaction_n;
  if (++gathered_ < ticks_per_update_) return;
  correct(gathered_n_ * (1.0 / gathered_), gathered_step_mm_, velocity_mm_per_s,
          gathered_periods_ * period_s_);
  gathered_ = 0;
}

void TrackedDirection::correct(const hal::Vector3& reaction_n, const hal::Vector3& step_mm,
                               const hal::Vector3& velocity_mm_per_s, double interval_s) noexcept {
  const hal::Vector3 before = normal_;
  const hal::Vector3 slide_mm = across(step_mm, normal_);
  const double press_mm = std::abs(dot(step_mm, normal_));
  const hal::Vector3 sliding_mm_per_s = across(velocity_mm_per_s, normal_);
  const double speed_mm_per_s = norm(sliding_mm_per_s);
  const double kinetic = friction_.kinetic;
  // Slower than the encoders resolve, a count is as likely their rounding as a slide.
  const double stuck = std::max(0.0, 1.0 - speed_mm_per_s * (1.0 / kStuckMmPerS));
  const FrictionSlide slide{slide_mm, std::max(0.0, norm(slide_mm) - kSlantOfPressing * press_mm),
                            1.0 - stuck};
  const double path_mm = slide.share * slide.path_mm;

  const double level_error = kFrictionError * kinetic;
  friction_state_.predict(slide, normal_, level_error,
                          stuck * kinetic * kinetic * (interval_s / kStuckTimeS));
  const double turn_rad =
      (path_mm + kSlantOfPressing * press_mm) * (1.0 / kTightestRadiusMm) + kDriftRadPerS * interval_s;
  // The same per second, whatever the interval; the constants are stated for kUpdateS.
  const double updates = std::max(interval_s, 0.05 * kUpdateS) * (1.0 / kUpdateS);
  normal_variance_ = std::min(normal_variance_ + turn_rad * turn_rad / updates, 1.0);

  // The reaction shows u - φ: it is divided by f_n.
  const hal::Vector3 without_viscous_n = reaction_n + sliding_mm_per_s * friction_.viscous_n_s_per_mm;
  const hal::Vector3& coefficient = friction_state_.coefficient();
  const double normal_n =
      std::max(kMinForceN, norm(without_viscous_n) / std::sqrt(1.0 + dot(coefficient, coefficient)));
  const hal::Vector3 innovation =
      across(without_viscous_n * (1.0 / normal_n) - (normal_ - coefficient), normal_);

  const double noise = force_variance_n2_ / (normal_n * normal_n);
  const double to_normal = normal_variance_ - friction_state_.covariance();
  const double to_friction = friction_state_.covariance() - friction_state_.variance();
  const double total = to_normal - to_friction + noise;
  const double normal_gain = to_normal / total;
  normal_ = direction_or(normal_ + innovation * normal_gain, normal_);
  normal_variance_ = std::max(0.0, normal_variance_ - normal_gain * to_normal);
  friction_state_.correct(innovation, normal_, normal_gain, total);
  give_back_excess();
  touching_s_ += interval_s;
  if (touching_s_ > kSettlingS) limit_turn(before, interval_s);

  friction_n_ = (coefficient * normal_n + sliding_mm_per_s * friction_.viscous_n_s_per_mm) * -1.0;
}

void TrackedDirection::give_back_excess() noexcept {
  const double limit = kMaxStatic * friction_.kinetic;
  const double size = norm(friction_state_.coefficient());
  if (size <= limit) return;
  const hal::Vector3 excess = friction_state_.coefficient() * (1.0 - limit / size);
  friction_state_.scale(limit / size);
  normal_ = direction_or(normal_ - excess, normal_);
  normal_variance_ = std::max(normal_variance_, dot(excess, excess));
}

void TrackedDirection::limit_turn(const hal::Vector3& before, double interval_s) noexcept {
  const hal::Vector3 turn = normal_ - before;
  const double most = kFastestTurnRadPerS * interval_s;
  const double size = norm(turn);
  if (size <= most) return;
  normal_ = direction_or(before + turn * (most / size), before);
  friction_state_.turn_into(normal_);
  normal_variance_ = std::max(normal_variance_, (size - most) * (size - most));
}

double TrackedDirection::deviation_rad() const noexcept {
  return std::sqrt(normal_variance_);
}

}  // namespace hapticd::rt
