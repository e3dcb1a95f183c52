#include "rt/explore/stiffness_force.h"

#include <algorithm>

#include "rt/control/compensation_fade.h"

namespace hapticd::rt {

void StiffnessForce::reset() noexcept {
  reaction_lead_.reset();
  reaction_ahead_n_ = 0.0;
}

double StiffnessForce::predict(ContactState& now) noexcept {
  const double compensated = compensation_share(target_.stiffness_n_per_mm());
  now.lead_s = options_.lead_s;
  // Followed also before there is any authority, so that the slope is known once there is.
  if (reaction_lead_.is_on()) {
    reaction_ahead_n_ = compensated * reaction_lead_.update(now.normal_n, now.tool.interval);
    // If the reaction is predicted, the displacement is too, by all of the delay: else less than no damping
    // is left.
    now.lead_s += compensated * std::max(0.0, options_.delay_s - options_.lead_s);
  }
  return compensated;
}

hal::Vector3 StiffnessForce::update(const ContactState& now, ContactRelease& release) noexcept {
  if (now.began || now.begins_anew || (now.tool.interval.is_gap && !now.in_contact)) late_.reset();
  if (!options_.is_modulated) return {};
  if (now.in_contact) return in_contact(now, release);
  if (now.authority == 0.0) {
    target_.rest(now.tool.interval.periods);
    return {};
  }
  if (options_.fades_last_force) return release.last_desired_n() * now.authority;
  const double receding = std::min(0.0, now.rate_mm_per_s);  // what is rendered may only shrink
  double target_n = target_.update(std::max(0.0, now.displacement_mm + options_.lead_s * receding), receding,
                                   now.tool.tip_mm, now.tool.interval.periods);
  // An object that has not let go, as where the contact was taken for none, still bears its part.
  const double left_n = std::clamp(dot(now.tool.reaction_n, now.normal), 0.0, release.last_reaction_n());
  if (late_.has_begun()) target_n -= late_.update(target_n, left_n, now.rate_mm_per_s, now.tool.interval.s);
  return now.normal * (now.authority * (target_n - left_n));
}

inline hal::Vector3 StiffnessForce::in_contact(const ContactState& now, ContactRelease& release) noexcept {
  const double rate = now.rate_mm_per_s;
  double target_n = target_.update(now.displacement_mm + now.lead_s * rate, rate, now.tool.tip_mm,
                                   now.tool.interval.periods);
  if (options_.needs_evidence && (now.authority > 0.0 || late_.has_begun())) {
    target_n -= late_.update(target_n, now.normal_n + reaction_ahead_n_, rate, now.tool.interval.s);
  }
  const hal::Vector3 desired_n =
      options_.keeps_friction ? now.normal * (target_n - now.normal_n - reaction_ahead_n_)
                              : now.normal * (target_n - reaction_ahead_n_) - now.tool.reaction_n;  // (4.4)
  release.remember(desired_n, std::max(0.0, now.normal_n));
  return desired_n * now.authority;
}

void StiffnessForce::hold_within(double max_n, const ContactState& now, hal::Vector3& desired_n) noexcept {
  if (!exceeds(desired_n, max_n)) return;
  const hal::Vector3 bound_n = desired_n * (max_n / norm(desired_n));
  late_.hold_back(dot(desired_n - bound_n, now.normal) / now.authority);
  desired_n = bound_n;
}

}  // namespace hapticd::rt
