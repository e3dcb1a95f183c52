#include <algorithm>
#include <cmath>
#include <utility>

#include "server/identification/estimate/contact/contact_variable_projection.h"
#include "server/identification/session/contact/contact_state.h"

namespace hapticd::identification {

namespace {

constexpr double kRefreshS = 0.25;  ///< of contact, between fits

}  // namespace

ContactDomain ContactIdentification::State::domain() const {
  ContactDomain domain;
  domain.displacement_mm = std::max(1e-3, deepest_mm);
  if (recorded) {
    if (fit.surface) domain.displacement_mm = std::max(1e-3, deepest_mm - fit.surface->surface_mm);
    domain.speed_mm_per_s = std::max(1e-3, fastest_mm_per_s);
    domain.speeds_required = false;
    domain.enough_samples = 3;
  } else if (task.displacement_mm > 0.0) {
    domain.displacement_mm = task.displacement_mm;
  } else if (largest_n > 0.0 && largest_n < task.force_n) {
    domain.displacement_mm *= std::pow(task.force_n / largest_n, 0.6);
  }
  if (!recorded) {
    // A brisk press: down in 0.4 s on average.
    domain.speed_mm_per_s =
        task.speed_mm_per_s > 0.0 ? task.speed_mm_per_s : std::clamp(2.5 * domain.displacement_mm, 3.0, 60.0);
  }
  return domain;
}

std::optional<HuntCrossleyEstimate> ContactIdentification::State::recursive(
    const std::vector<PalpationSample>& palpation) const {
  if (!recorded) return single.estimate();
  SingleStageEstimator estimator(single_options());
  for (const PalpationSample& s : palpation) estimator.add(s);
  return estimator.estimate();
}

std::optional<HuntCrossleyEstimate> ContactIdentification::State::batch(
    const std::vector<PalpationSample>& palpation) const {
  VariableProjectionOptions options;
  if (!recorded) return fit_by_variable_projection(palpation, options);
  double deepest = 0.0;
  for (const PalpationSample& s : palpation) deepest = std::max(deepest, s.displacement_mm);
  options.min_offset_mm = -0.1 * deepest;
  options.max_offset_mm = 0.1 * deepest;
  return fit_by_variable_projection(palpation, options);
}

/// Choice of a law; none if one law was asked for by name.
std::optional<ContactLawChoice> ContactIdentification::State::choice(const Fit& current) const {
  if (!wants_creep() || !wants_hunt_crossley()) return std::nullopt;
  const double surface_mm = recorded && current.surface ? current.surface->surface_mm : 0.0;
  const double offset_mm = recorded ? 0.1 * (deepest_mm - surface_mm) : 0.0;
  return choose_contact_law(creep, surface_mm, offset_mm, recorded ? 48 : 80);
}

std::optional<CreepEstimate> ContactIdentification::State::creep_law(const Fit& current,
                                                                     bool thorough) const {
  CreepFit::Options options;
  options.elastic = !current.creeps;
  options.surface_mm = recorded && current.surface ? current.surface->surface_mm : 0.0;
  if (recorded) options.fewest_samples = 60;
  if (!thorough) {
    options.max_rows = 1500;
    if (current.creep) {
      options.start = &current.creep->law.parameters;
      options.first_step = 0.02;
    }
  }
  return creep.solve(options);
}

void ContactIdentification::State::refresh() {
  const bool fresh =
      fit.made && (recorded ? gate.used() == fit.at_used : contact_s < fit.at_contact_s + kRefreshS);
  if (fresh) return;
  Fit next;
  next.made = true;
  next.at_contact_s = contact_s;
  next.at_used = gate.used();
  next.palpation = kept.items();
  if (recorded) {
    next.surface = surface_from_first_loading(next.palpation);
    if (next.surface) {
      for (PalpationSample& s : next.palpation) s.displacement_mm -= next.surface->surface_mm;
    }
    fit.surface = next.surface;
  }
  next.hunt_crossley =
      task.method == ContactFitMethod::kBatch ? batch(next.palpation) : recursive(next.palpation);
  if (next.hunt_crossley)
    next.uncertainty = hunt_crossley_uncertainty(*next.hunt_crossley, next.palpation, false);
  if (wants_creep()) {
    next.creep = fit.creep;
    if (fit.creep == std::nullopt || contact_s > fit.at_contact_s)
      next.creep = creep_law(next.creep ? fit : next, false);
    if (fit.creep && next.creep && contact_s > fit.at_contact_s) {
      const auto& before = fit.creep->law.parameters;
      const rt::CreepParameters& after = next.creep->law.parameters;
      const rt::CreepLaw was(before, rig.rate_hz), is(after, rig.rate_hz);
      double moved = std::abs(before.weight[0] + before.weight[1] - after.weight[0] - after.weight[1]);
      for (const double share : {0.5, 1.0}) {
        const double n = share * before.max_force_n;
        moved =
            std::max(moved, std::abs(std::log(was.curve(n).displacement_mm / is.curve(n).displacement_mm)));
      }
      creep_moved = moved / (contact_s - fit.at_contact_s);
    }
  }
  next.domain = domain();
  next.coverage = contact_coverage(next.palpation, kept.stride(), next.domain);
  fit = std::move(next);
  judge(fit);
}

}  // namespace hapticd::identification
