#include "rt/contact/contact_evidence.h"

#include <algorithm>

namespace hapticd::rt {

ContactEvidence::ContactEvidence(const EvidenceParameters& parameters, double threshold_n,
                                 double tool_mass_g) noexcept
    : parameters_(parameters), threshold_n_(threshold_n), tool_mass_g_(tool_mass_g) {
  if (parameters_.unexplained_force_n == 0.0) {
    parameters_.unexplained_force_n = default_unexplained_force_n(threshold_n);
  }
}

void ContactEvidence::reset() noexcept {
  acceleration_mm_per_s2_ = 0.0;
  begin();
}

void ContactEvidence::begin() noexcept {
  min_n_.fill(-std::numeric_limits<double>::infinity());
  slot_ = 0;
  slot_s_ = 0.0;
  min_n_[slot_] = std::numeric_limits<double>::infinity();
  earned_ = goal_ = sloped_ = 0.0;
  slope_.reset();
  is_sloped_ = goes_on_ = false;
  support_ = 1.0;
  secant_n_per_mm_ = 0.0;
  lost_s_ = 0.0;
  plausible_ = true;
}

void ContactEvidence::follow_acceleration(double acceleration_mm_per_s2, double s) noexcept {
  acceleration_mm_per_s2_ =
      std::max(acceleration_mm_per_s2, acceleration_mm_per_s2_ / (1.0 + s / kAccelerationMemoryS));
}

void ContactEvidence::rest(double acceleration_mm_per_s2, double noise_n,
                           const TickInterval& interval) noexcept {
  follow_acceleration(acceleration_mm_per_s2, interval.s);
  const double seen_n = std::min(noise_n, kMaxNoiseN);
  variance_n2_ += (seen_n * seen_n - variance_n2_) * (interval.s / (interval.s + kNoiseS));
}

double ContactEvidence::sustained_n(double evidence_n, double s) noexcept {
  min_n_[slot_] = std::min(min_n_[slot_], evidence_n);
  const double min_n = *std::min_element(min_n_.begin(), min_n_.end());
  slot_s_ += s;
  if (slot_s_ * kSlots >= kSustainedS) {
    slot_ = slot_ + 1 < kSlots ? slot_ + 1 : 0;
    min_n_[slot_] = std::numeric_limits<double>::infinity();
    slot_s_ = 0.0;
  }
  return min_n;
}

void ContactEvidence::follow_support(const Observation& now, double s) noexcept {
  const double depth_mm = std::max(now.displacement_mm, kMinDepthMm + kDeflectionError * now.deflection_mm);
  const double secant = std::max(0.0, now.reaction_n) / depth_mm;
  // Compared with what came before this tick, so that a sudden loss does not lower what it is compared with.
  const double share = secant_n_per_mm_ > 0.0 ? secant / secant_n_per_mm_ : 1.0;
  const double by_depth = (share - kLostShare) / (kFullShare - kLostShare);
  const double by_force = 0.5 * (now.reaction_n / (threshold_n_ + noise_n_) - 1.0);
  support_ = std::clamp(std::min(by_depth, by_force), 0.0, std::min(1.0, support_ + s / kGrowS));
  if (secant_n_per_mm_ <= 0.0) {
    secant_n_per_mm_ = secant;
  } else if (share > kLostShare) {
    secant_n_per_mm_ += (secant - secant_n_per_mm_) * (s / (s + kSecantS));
  }
}

void ContactEvidence::update(const Observation& now, const TickInterval& interval) noexcept {
  const double s = interval.s;
  follow_acceleration(now.acceleration_mm_per_s2, s);
  if (goal_ < 1.0) {  // else all is earned
    const double inertia_n = inertial_force_n(tool_mass_g_, acceleration_mm_per_s2_);
    const double evidence_n = now.reaction_n - parameters_.unexplained_force_n - inertia_n;
    const double at_once_n = evidence_n - inertial_force_n(tool_mass_g_, kUnseenMmPerS2);
    const double proven_n = std::max(sustained_n(evidence_n, s), at_once_n);
    goal_ = std::max(goal_, std::clamp(proven_n / parameters_.unexplained_force_n, 0.0, 1.0));
  }
  earned_ = std::min(goal_, earned_ + s / kGrowS);
  if (!is_sloped_ && earned_ < 1.0) {
    slope_.add(now.reaction_n, now.path_mm, now.inward_mm_per_s2);
    if (now.reaction_n > threshold_n_ + noise_n_ &&
        slope_.shows_object(noise_n(), parameters_.lowest_stiffness_n_per_mm, kGrownN)) {
      is_sloped_ = goes_on_;
      goes_on_ = true;
      slope_.reset();
    }
  }
  if (is_sloped_) sloped_ = std::min(1.0, sloped_ + s / kGrowS);

  const bool resists = now.reaction_n >= parameters_.lowest_stiffness_n_per_mm * (now.path_mm - kFreePathMm);
  if (proven()) follow_support(now, s);
  lost_s_ = resists && support_ > 0.0 ? 0.0 : lost_s_ + s;
  if (lost_s_ >= kLostS) plausible_ = false;
}

}  // namespace hapticd::rt
