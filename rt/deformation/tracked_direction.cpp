#include "rt/deformation/tracked_direction.h"

#include <algorithm>
#include <cmath>

#include "rt/friction/dahl.h"

namespace hapticd::rt {

namespace {
constexpr double kLeastForceN = 1e-3;
}

TrackedDirection::TrackedDirection(const FrictionParameters& friction, double force_noise_n,
                                   double rate_hz) noexcept
    : friction_(friction), period_s_(1.0 / rate_hz), force_variance_n2_(force_noise_n * force_noise_n) {}

void TrackedDirection::begin(const hal::Vector3& reaction_n) noexcept {
  normal_ = direction_or(reaction_n, normal_);
  built_up_ = {};
  friction_n_ = {};
  const double force_n = std::max(norm(reaction_n), kLeastForceN);
  variance_rad2_ = std::min(1.0, force_variance_n2_ / (force_n * force_n));
}

void TrackedDirection::update(const hal::Vector3& reaction_n,
                              const hal::Vector3& velocity_mm_per_s) noexcept {
  const hal::Vector3 sliding_mm_per_s = across(velocity_mm_per_s, normal_);
  built_up_ = dahl_step(built_up_, sliding_mm_per_s * period_s_, friction_.presliding_mm);

  const hal::Vector3 viscous_n = sliding_mm_per_s * friction_.viscous_n_s_per_mm;
  const hal::Vector3 dry = across(built_up_, normal_) * friction_.kinetic;
  const hal::Vector3 without_viscous_n = reaction_n + viscous_n;
  const double normal_n = std::max(kLeastForceN, norm(without_viscous_n) / std::sqrt(1.0 + dot(dry, dry)));
  const hal::Vector3 seen = direction_or(without_viscous_n * (1.0 / normal_n) + dry, normal_);

  const double turn_rad = period_s_ * (norm(sliding_mm_per_s) * (1.0 / kTightestRadiusMm) + kDriftRadPerS);
  variance_rad2_ += turn_rad * turn_rad;
  const double noise_rad2 = std::min(4.0, force_variance_n2_ / (normal_n * normal_n));
  const double gain = variance_rad2_ / (variance_rad2_ + noise_rad2);
  variance_rad2_ *= 1.0 - gain;
  normal_ = direction_or(normal_ + (seen - normal_) * gain, normal_);
  friction_n_ = (dry * normal_n + viscous_n) * -1.0;
}

double TrackedDirection::deviation_rad() const noexcept {
  return std::sqrt(variance_rad2_);
}

}  // namespace hapticd::rt
