#include <algorithm>
#include <cmath>
#include <cstdio>

#include "server/identification/session/contact/contact_state.h"

namespace hapticd::identification {

namespace {

constexpr double kGradientOverS = 1.0;  ///< of contact
constexpr double kSteadyPerS = 0.03;    ///< relative
constexpr double kCertainForce = 0.05;  ///< relative
constexpr double kCertainExponent = 0.15;
constexpr double kCertainWeight = 0.1;

double change(const ContactSnapshot& a, const ContactSnapshot& b) {
  return std::max({std::abs(a.log_force - b.log_force), std::abs(a.log_force_half - b.log_force_half),
                   std::abs(a.exponent - b.exponent), std::abs(a.rate_term - b.rate_term)});
}

/// Largest error of a weight of what creeps. What yields at once and what within the shortest lag look alike,
/// and it does not matter.
double largest_weight_error(const CreepEstimate& estimate) {
  return *std::max_element(estimate.weight_error.begin() + 2, estimate.weight_error.end());
}

}  // namespace

ContactSnapshot snapshot_of(const HuntCrossleyEstimate& estimate, double contact_s, double deepest_mm,
                            double speed_mm_per_s) {
  const rt::HuntCrossleyParameters& p = estimate.parameters;
  const double log_k = std::log(p.stiffness_n_per_mm_m);
  return {contact_s, log_k + p.exponent * std::log(deepest_mm),
          log_k + p.exponent * std::log(0.5 * deepest_mm), p.exponent,
          p.damping_n_s_per_mm_m1 / p.stiffness_n_per_mm_m * speed_mm_per_s};
}

bool ContactIdentification::State::steady_now(const Fit& current) const {
  if (recorded) {
    // True if the last fifth of it would have changed something.
    if (!current.hunt_crossley) return false;
    const auto share = static_cast<std::ptrdiff_t>(4 * current.palpation.size() / 5);
    const std::vector<PalpationSample> most(current.palpation.begin(), current.palpation.begin() + share);
    const auto before = task.method == ContactFitMethod::kBatch ? batch(most) : recursive(most);
    if (!before) return false;
    const double x = current.domain.displacement_mm;
    const double v = current.domain.speed_mm_per_s;
    return change(snapshot_of(*current.hunt_crossley, 0.0, x, v), snapshot_of(*before, 0.0, x, v)) < 0.05;
  }
  const auto back = static_cast<std::size_t>(kGradientOverS / kSnapshotS);
  if (snapshots_taken <= back) return false;
  const ContactSnapshot& last = snapshots[(snapshots_taken - 1) % snapshots.size()];
  const ContactSnapshot& before = snapshots[(snapshots_taken - 1 - back) % snapshots.size()];
  const bool creep_steady = !wants_creep() || creep_moved < 2.0 * kSteadyPerS;
  return creep_steady && change(last, before) < kSteadyPerS * (last.contact_s - before.contact_s);
}

void ContactIdentification::State::judge(Fit& current) const {
  current.steady = steady_now(current);
  current.certain = true;
  current.needs = {};
  char text[120];
  if (wants_hunt_crossley()) {
    const HuntCrossleyUncertainty& u = current.uncertainty;
    // No need to know the parameters better than the law knows the object.
    const double enough = std::max(kCertainForce, u.residual);
    const bool sure = current.hunt_crossley && u.relative_force < enough && u.relative_force_half < enough &&
                      u.exponent < kCertainExponent;
    if (!sure && current.hunt_crossley) {
      std::snprintf(text, sizeof text, "the exponent is known to ±%.2g, the force to ±%.2g %%", u.exponent,
                    100.0 * std::max(u.relative_force, u.relative_force_half));
      current.needs.uncertain = text;
    }
    current.certain = current.certain && sure;
  }
  if (wants_creep()) {
    const double off = !current.creeps ? 0.0 : current.creep ? largest_weight_error(*current.creep) : 1.0;
    const bool sure = current.creep && off < kCertainWeight &&
                      current.creep->relative_displacement < kCertainForce &&
                      current.creep->relative_displacement_half < kCertainForce;
    if (!sure && current.creep && current.needs.uncertain.empty()) {
      std::snprintf(text, sizeof text, "how much creeps is known to ±%.2g", off);
      current.needs.uncertain = text;
    }
    current.certain = current.certain && sure;
  }
  current.needs = needs_of(current);
  current.converged = current.steady && current.certain && missing_in_words(current.needs).empty();
}

PalpationNeeds ContactIdentification::State::needs_of(const Fit& current) const {
  PalpationNeeds needs = current.needs;
  needs.force_n = task.force_n;
  needs.displacement_mm = recorded ? 0.0 : task.displacement_mm;
  needs.largest_force_n = recorded ? task.force_n : largest_n;
  needs.deepest_mm = deepest_mm;
  needs.hold_wanted = !recorded && wants_creep();
  needs.held_s = held_s;
  needs.speed_mm_per_s = current.domain.speed_mm_per_s;
  if (contact_s > 0.0) needs.coverage = missing_coverage(current.coverage, current.domain);
  needs.steady = current.steady;
  needs.certain = current.certain;
  needs.contacts = recorded ? recording.contacts() : tracker.contacts();
  return needs;
}

}  // namespace hapticd::identification
