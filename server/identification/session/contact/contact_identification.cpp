#include "server/identification/session/contact/contact_identification.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <optional>
#include <utility>

#include "server/identification/session/contact/contact_state.h"
#include "server/identification/session/contact/contact_words.h"

namespace hapticd::identification {

namespace {

constexpr std::size_t kFitPoints = 200;

/// Error rms of x̂/x - 1 beyond a tenth of the deepest (IdentifiedLaw::relative_error).
double relative_displacement_error(const rt::HuntCrossleyParameters& law,
                                   const std::vector<PalpationSample>& palpation, double deepest_mm) {
  double sum = 0.0;
  std::size_t count = 0;
  for (const PalpationSample& s : palpation) {
    if (!identifies_contact(s) || s.displacement_mm < 0.1 * deepest_mm) continue;
    const double x = rt::hunt_crossley_displacement(law, s.normal_force_n, s.rate_mm_per_s).displacement_mm;
    sum += std::pow(x / s.displacement_mm - 1.0, 2);
    ++count;
  }
  return count > 0 ? std::clamp(std::sqrt(sum / static_cast<double>(count)), 1e-3, 1.0) : 1.0;
}

}  // namespace

void ContactIdentification::State::track_hold(const PalpationSample& s, double step_s) {
  const bool rests = s.in_contact && s.normal_force_n > 0.4 * task.force_n &&
                     std::abs(s.rate_mm_per_s) < std::max(1.0, 0.2 * deepest_mm);
  holding_s = rests ? holding_s + step_s : 0.0;
  held_s = std::max(held_s, holding_s);
}

void ContactIdentification::State::take(const PalpationSample& s) {
  const double step_s = started ? s.time_s - last_sample_s : 1.0 / rig.rate_hz;
  started = true;
  last_sample_s = s.time_s;
  if (wants_creep()) creep.add(s, step_s);
  track_hold(s, step_s);
  if (!s.in_contact) return;
  contact_s += std::min(step_s, 5.0 / rig.rate_hz);
  deepest_mm = std::max(deepest_mm, s.displacement_mm);
  fastest_mm_per_s = std::max(fastest_mm_per_s, std::abs(s.rate_mm_per_s));
  largest_n = std::max(largest_n, s.normal_force_n);
  kept.add(s);
  if (recorded) return;  // where the surface is will be known later
  single.add(s);
  if (contact_s < next_snapshot_s) return;
  next_snapshot_s += kSnapshotS;
  if (const auto now = single.estimate()) {
    snapshots[snapshots_taken++ % snapshots.size()] =
        snapshot_of(*now, contact_s, deepest_mm, domain().speed_mm_per_s);
  }
}

ContactIdentification::ContactIdentification(const ContactTask& task, const hal::RigInfo& rig)
    : IdentificationSession(contact_kind()), state_(std::make_unique<State>(task, rig)) {}
ContactIdentification::~ContactIdentification() = default;

void ContactIdentification::add(const rt::Observation& observation) {
  State& s = *state_;
  const hal::RigSample& sample = observation.sample;
  const SampleGate::Verdict verdict = s.gate.judge(sample);
  if (verdict == SampleGate::Verdict::kSkip) return;
  if (s.gate.used() == 1) s.first_ns = sample.time_ns;
  s.last_ns = sample.time_ns;
  const bool restart = verdict == SampleGate::Verdict::kRestart;
  if (s.recorded) {
    if (restart) s.recording.restart();
    s.extent.add(-sample.tip_position_mm.z, sample.sensor_force_n.z);
    PalpationSample out;
    if (s.recording.update(sample, out)) s.take(out);
    return;
  }
  if (restart) s.tracker.restart();
  const PalpationSample out = s.tracker.update(sample);
  if (!s.tracker.settled()) return;
  s.extent.add(-sample.tip_position_mm.z, out.normal_force_n);
  s.take(out);
}

MotionRequest ContactIdentification::next_request() const {
  State& s = *state_;
  if (s.recorded) return {};
  s.refresh();
  return next_palpation(s.fit.needs);
}

void ContactIdentification::find(IdentificationProgress& progress) const {
  State& s = *state_;
  s.refresh();
  const State::Fit& fit = s.fit;
  progress.samples = s.kept.added();
  progress.duration_s = 1e-9 * static_cast<double>(s.last_ns - s.first_ns);
  s.list_parameters(fit, fit.hunt_crossley, fit.uncertainty, fit.creep, progress.parameters);
  const bool by_hunt_crossley = s.wants_hunt_crossley() && fit.hunt_crossley;
  progress.residual = by_hunt_crossley ? fit.uncertainty.residual
                      : fit.creep      ? fit.creep->residual
                                       : progress.residual;
  progress.coverage.push_back(fit.coverage);
  if (fit.hunt_crossley) {
    const std::size_t every = fit.palpation.size() / kFitPoints + 1;
    for (std::size_t i = 0; i < fit.palpation.size(); i += every) {
      const PalpationSample& p = fit.palpation[i];
      progress.fit.push_back(
          {p.displacement_mm, p.normal_force_n,
           rt::hunt_crossley_force_n(fit.hunt_crossley->parameters, p.displacement_mm, p.rate_mm_per_s)});
    }
  }
  progress.steady = fit.steady;
  progress.certain = fit.certain;
  progress.converged = fit.converged;
  progress.remarks = s.gate.remarks();
  const auto refused = palpation_refusal(s.extent, s.gate, s.task.threshold_n, s.recorded);
  if (refused && progress.duration_s > 2.0)
    progress.remarks.insert(progress.remarks.begin(), refused->what + ": " + refused->remedy);
  progress.missing = missing_in_words(fit.needs);
  const double depth =
      s.task.force_n > 0.0 && !s.recorded ? std::min(1.0, s.largest_n / s.task.force_n) : 1.0;
  double done = s.contact_s > 0.0 ? 0.25 * depth + 0.45 * fit.coverage.share : 0.0;
  done += (fit.steady ? 0.13 : 0.0) + (fit.certain && fit.hunt_crossley ? 0.13 : 0.0);
  progress.completion = std::min(0.99, done);
}

std::optional<hal::Error> ContactIdentification::conclude(const IdentificationProgress& /*now*/,
                                                          rt::IdentifiedModel& model) const {
  const State& s = *state_;
  if (auto refused = palpation_refusal(s.extent, s.gate, s.task.threshold_n, s.recorded)) return refused;
  State::Fit fit = s.fit;
  const auto choice = s.choice(fit);
  const bool recursive = s.task.method == ContactFitMethod::kRecursive;

  rt::ContactModel contact;
  std::optional<HuntCrossleyEstimate> law;
  HuntCrossleyUncertainty uncertainty;
  if (s.wants_hunt_crossley()) {
    law = recursive ? fit.hunt_crossley : s.batch(fit.palpation);
    if (law) {
      uncertainty = hunt_crossley_uncertainty(*law, fit.palpation, s.recorded && !recursive);
      std::vector<PalpationSample> shifted = fit.palpation;
      double deepest_mm = 0.0;
      for (PalpationSample& p : shifted) {
        p.displacement_mm += law->contact_offset_mm;
        deepest_mm = std::max(deepest_mm, p.displacement_mm);
      }
      contact.hunt_crossley = {law->parameters,
                               relative_displacement_error(law->parameters, shifted, deepest_mm)};
    }
  }
  std::optional<CreepEstimate> creep;
  if (s.wants_creep()) {
    fit.creeps = !choice || choice->curve() == ContactLawForm::kCreep;
    creep = s.creep_law(fit, true);
    if (creep) contact.creep = creep->law;
  }
  if (choice && choice->power_is_unfit() && creep) {
    contact.hunt_crossley.reset();
    law.reset();
  }
  if (!fit.creeps) {
    // What creeps need not be known if nothing does.
    fit.creep = creep;
    s.judge(fit);
  }
  const bool missing_law = (s.task.law && s.wants_hunt_crossley() && !contact.hunt_crossley) ||
                           (s.task.law && s.wants_creep() && !contact.creep);
  if (missing_law || (!contact.hunt_crossley && !contact.creep)) {
    const std::vector<std::string> missing = missing_in_words(fit.needs);
    return refusal(
        "the palpation does not determine the model's parameters",
        std::to_string(s.kept.added()) + " samples in contact",
        "at least 100, at different depths and speeds",
        missing.empty() || s.recorded ? "press deeper, at several speeds, and for longer" : missing.front());
  }
  model.content = contact;
  char text[160];
  std::snprintf(text, sizeof text, "%u contacts in %.1f s, up to %.3g N; %s",
                s.recorded ? s.recording.contacts() : s.tracker.contacts(),
                1e-9 * static_cast<double>(s.last_ns - s.first_ns), s.largest_n, words_of(s.task.method));
  model.procedure = text;
  model.parameters.clear();
  s.list_parameters(fit, law, uncertainty, creep, model.parameters);
  if (creep) model.procedure += words_of_unseen(*creep);
  if (choice) {
    model.procedure += words_of(*choice);
    for (const auto& [name, error] : {std::pair{"held_out_power", choice->power},
                                      {"held_out_elastic_curve", choice->elastic_curve},
                                      {"held_out_creep", choice->creep}}) {
      if (std::isfinite(error.relative))
        model.parameters.push_back({name, "1", error.relative, error.deviation});
    }
  }
  double deepest_mm = 0.0;
  for (const PalpationSample& p : fit.palpation) deepest_mm = std::max(deepest_mm, p.displacement_mm);
  model.validity = {deepest_mm, s.fastest_mm_per_s, s.largest_n};
  model.residual = law ? uncertainty.residual : creep->residual;
  model.converged = fit.converged;
  return std::nullopt;
}

}  // namespace hapticd::identification
