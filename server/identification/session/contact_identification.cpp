#include "server/identification/session/contact_identification.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <optional>

#include "server/identification/estimate/contact/contact_creep_fit.h"
#include "server/identification/estimate/contact/contact_double_stage.h"
#include "server/identification/estimate/contact/contact_estimate.h"
#include "server/identification/estimate/contact/contact_law_choice.h"
#include "server/identification/estimate/contact/contact_single_stage.h"
#include "server/identification/estimate/contact/contact_surface.h"
#include "server/identification/estimate/contact/contact_variable_projection.h"
#include "server/identification/gate/palpation_tracker.h"
#include "server/identification/gate/sample_gate.h"
#include "server/identification/session/contact_refusal.h"
#include "server/identification/session/contact_requests.h"
#include "server/identification/session/coverage_map.h"

namespace hapticd::rt {

namespace {

constexpr std::size_t kSamplesKept = 16'384;
constexpr double kRefreshS = 0.25;      ///< of contact, between fits
constexpr double kSnapshotS = 0.25;     ///< of contact, between looks at whether the estimate still moves
constexpr double kGradientOverS = 1.0;  ///< of contact
constexpr double kSteadyPerS = 0.03;    ///< relative
constexpr double kCertainForce = 0.05;  ///< relative
constexpr double kCertainExponent = 0.15;
constexpr double kCertainWeight = 0.1;
constexpr std::size_t kFitPoints = 200;

/// What of an estimate has to have come to rest.
struct Snapshot {
  double contact_s = 0.0;
  double log_force = 0.0, log_force_half = 0.0;  ///< at the deepest and at half of it
  double exponent = 0.0;
  double rate_term = 0.0;  ///< B/K at the required speed
};

Snapshot snapshot_of(const HuntCrossleyEstimate& estimate, double contact_s, double deepest_mm,
                     double speed_mm_per_s) {
  const HuntCrossleyParameters& p = estimate.parameters;
  const double log_k = std::log(p.stiffness_n_per_mm_m);
  return {contact_s, log_k + p.exponent * std::log(deepest_mm),
          log_k + p.exponent * std::log(0.5 * deepest_mm), p.exponent,
          p.damping_n_s_per_mm_m1 / p.stiffness_n_per_mm_m * speed_mm_per_s};
}

double change(const Snapshot& a, const Snapshot& b) {
  return std::max({std::abs(a.log_force - b.log_force), std::abs(a.log_force_half - b.log_force_half),
                   std::abs(a.exponent - b.exponent), std::abs(a.rate_term - b.rate_term)});
}

/// Of what creeps. What yields at once and what within the shortest lag look alike, and it does not matter.
double largest_weight_error(const CreepEstimate& estimate) {
  return *std::max_element(estimate.weight_error.begin() + 2, estimate.weight_error.end());
}

const char* words_of(ContactFitMethod method) {
  switch (method) {
    case ContactFitMethod::kRecursive:
      return "gated single-stage log-linear recursive least squares";
    case ContactFitMethod::kDoubleStage:
      return "double-stage recursive least squares";
    case ContactFitMethod::kBatch:
      return "variable projection";
    case ContactFitMethod::kRecursiveThenBatch:
      break;
  }
  return "recursive least squares, then variable projection";
}

std::string words_of(const ContactLawChoice& choice) {
  const auto percent = [](const HeldOutError& error) {
    char text[40];
    std::snprintf(text, sizeof text, "%.2g %%", 100.0 * error.relative);
    return std::string(std::isfinite(error.relative) ? text : "no fit");
  };
  std::string words = "; displacement held out of the fit is missed by: power law " + percent(choice.power) +
                      ", elastic curve " + percent(choice.elastic_curve) + ", creep " +
                      percent(choice.creep) + "; chosen: ";
  switch (choice.form) {
    case ContactLawForm::kPower:
      words += "power law";
      break;
    case ContactLawForm::kElasticCurve:
      words += "elastic curve";
      break;
    case ContactLawForm::kCreep:
      words += "creep";
      break;
  }
  if (choice.power_is_unfit()) words += "; the power law is left out: more than a hand can feel is missing";
  return words;
}

/// What creeps more slowly than any contact lasted; empty where all was seen.
std::string words_of_unseen(const CreepEstimate& creep) {
  const auto& times_s = creep.law.parameters.time_s;
  double longest_s = 0.0;
  bool unseen = false;
  for (std::size_t l = 0; l < times_s.size(); ++l) {
    unseen = unseen || !creep.lag_determined[l];
    if (creep.lag_determined[l]) longest_s = std::max(longest_s, times_s[l]);
  }
  if (!unseen) return {};
  char text[120];
  std::snprintf(text, sizeof text,
                "; what creeps over more than %.2g s is not known: no press was held that long", longest_s);
  return text;
}

/// rms of x̂/x - 1 beyond a tenth of the deepest (IdentifiedLaw::relative_error).
double relative_displacement_error(const HuntCrossleyParameters& law,
                                   const std::vector<PalpationSample>& palpation, double deepest_mm) {
  double sum = 0.0;
  std::size_t count = 0;
  for (const PalpationSample& s : palpation) {
    if (!identifies_contact(s) || s.displacement_mm < 0.1 * deepest_mm) continue;
    const double x = hunt_crossley_displacement(law, s.normal_force_n, s.rate_mm_per_s).displacement_mm;
    sum += std::pow(x / s.displacement_mm - 1.0, 2);
    ++count;
  }
  return count > 0 ? std::clamp(std::sqrt(sum / static_cast<double>(count)), 1e-3, 1.0) : 1.0;
}

}  // namespace

struct ContactIdentification::State {
  State(const ContactTask& contact_task, const hal::RigInfo& rig_info)
      : task(contact_task),
        rig(rig_info),
        recorded(rig_info.kind == hal::RigKind::kReplay),
        gate(palpation_policy(rig_info)),
        tracker(rig_info.sensor.tool_mass_g, contact_task.threshold_n,
                rig_info.device.position_resolution_mm > 0.0 ? rig_info.device.position_resolution_mm : 0.03,
                rig_info.rate_hz),
        recording(contact_task.threshold_n, rig_info.rate_hz),
        single(single_options()),
        twofold(double_options()),
        creep(creep_times_s(1.0 / rig_info.rate_hz), recorded ? 1 : 3),
        kept(kSamplesKept) {}

  bool wants_hunt_crossley() const { return !task.law || *task.law == ContactLawKind::kHuntCrossley; }
  bool wants_creep() const { return !task.law || *task.law == ContactLawKind::kCreep; }

  SingleStageEstimator::Options single_options() const {
    SingleStageEstimator::Options options;
    options.least_force_n = 5.0 * task.threshold_n;
    if (recorded) options.fewest_samples = 30;
    options.mean_of = std::clamp(static_cast<int>(rig.rate_hz / 250.0), 1, 4);
    return options;
  }
  DoubleStageEstimator::Options double_options() const {
    DoubleStageEstimator::Options options;
    options.least_force_n = 5.0 * task.threshold_n;
    if (recorded) {
      // A recording is short and over: nothing of it is to be forgotten.
      options.fewest_samples = 30;
      options.forgetting = 1.0;
    }
    return options;
  }

  void take(const PalpationSample& sample);
  void track_hold(const PalpationSample& sample, double step_s);
  ContactDomain domain() const;

  // Made from the samples kept, when it is asked for and enough is new.
  struct Fit {
    bool made = false;
    double at_contact_s = -1.0;
    std::uint64_t at_used = 0;
    std::vector<PalpationSample> palpation;  ///< displacement from the surface
    std::optional<SurfaceEstimate> surface;
    std::optional<HuntCrossleyEstimate> hunt_crossley;
    HuntCrossleyUncertainty uncertainty;
    std::optional<CreepEstimate> creep;
    bool creeps = true;  ///< false: what creeps is not asked for, the curve is elastic
    Coverage coverage;
    ContactDomain domain;
    bool steady = false, certain = false, converged = false;
    PalpationNeeds needs;
  };
  void refresh();
  std::optional<HuntCrossleyEstimate> recursive(const std::vector<PalpationSample>& palpation) const;
  std::optional<HuntCrossleyEstimate> batch(const std::vector<PalpationSample>& palpation) const;
  std::optional<CreepEstimate> creep_law(const Fit& current, bool thorough) const;
  std::optional<ContactLawChoice> choice(const Fit& current) const;
  void judge(Fit& next) const;
  bool steady_now(const Fit& next) const;
  PalpationNeeds needs_of(const Fit& current) const;
  void list_parameters(const Fit& current, const std::optional<HuntCrossleyEstimate>& law,
                       const HuntCrossleyUncertainty& uncertainty,
                       const std::optional<CreepEstimate>& creep_found,
                       std::vector<EstimatedParameter>& parameters) const;

  ContactTask task;
  hal::RigInfo rig;
  bool recorded;
  SampleGate gate;
  PalpationExtent extent;
  PalpationTracker tracker;
  RecordedPalpation recording;
  SingleStageEstimator single;
  DoubleStageEstimator twofold;
  CreepFit creep;
  ThinnedSeries<PalpationSample> kept;  ///< in contact

  bool started = false;
  std::int64_t first_ns = 0, last_ns = 0;
  double last_sample_s = 0.0;
  double contact_s = 0.0;
  double deepest_mm = 0.0, fastest_mm_per_s = 0.0, largest_n = 0.0;
  double held_s = 0.0, holding_s = 0.0;
  double next_snapshot_s = kSnapshotS;
  std::array<Snapshot, 8> snapshots{};
  std::size_t snapshots_taken = 0;
  Fit fit;
  double completion = 0.0;
  double creep_moved = 1.0;  ///< relative change of Ψ per second of contact between the last two looks
};

// --- a tick at a time ---

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
  if (task.method == ContactFitMethod::kDoubleStage) twofold.add(s);
  if (contact_s < next_snapshot_s) return;
  next_snapshot_s += kSnapshotS;
  const auto now = task.method == ContactFitMethod::kDoubleStage ? twofold.estimate() : single.estimate();
  if (now) {
    snapshots[snapshots_taken++ % snapshots.size()] =
        snapshot_of(*now, contact_s, deepest_mm, domain().speed_mm_per_s);
  }
}

ContactIdentification::ContactIdentification(const ContactTask& task, const hal::RigInfo& rig)
    : state_(std::make_unique<State>(task, rig)) {}
ContactIdentification::~ContactIdentification() = default;

void ContactIdentification::add(const Observation& observation) {
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

// --- fits ---

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
    // As fast as a brisk press gets: down in 0.4 s on average.
    domain.speed_mm_per_s =
        task.speed_mm_per_s > 0.0 ? task.speed_mm_per_s : std::clamp(2.5 * domain.displacement_mm, 3.0, 60.0);
  }
  return domain;
}

std::optional<HuntCrossleyEstimate> ContactIdentification::State::recursive(
    const std::vector<PalpationSample>& palpation) const {
  const bool twofold_wanted = task.method == ContactFitMethod::kDoubleStage;
  if (!recorded) return twofold_wanted ? twofold.estimate() : single.estimate();
  if (twofold_wanted) {
    DoubleStageEstimator estimator(double_options());
    for (const PalpationSample& s : palpation) estimator.add(s);
    return estimator.estimate();
  }
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
  options.least_offset_mm = -0.1 * deepest;
  options.most_offset_mm = 0.1 * deepest;
  return fit_by_variable_projection(palpation, options);
}

/// None where one law was asked for by name.
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
    options.most_rows = 1500;
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
      const CreepParameters& after = next.creep->law.parameters;
      const CreepLaw was(before, rig.rate_hz), is(after, rig.rate_hz);
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

bool ContactIdentification::State::steady_now(const Fit& current) const {
  if (recorded) {
    // Would the last fifth of it have changed anything?
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
  const Snapshot& last = snapshots[(snapshots_taken - 1) % snapshots.size()];
  const Snapshot& before = snapshots[(snapshots_taken - 1 - back) % snapshots.size()];
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

void ContactIdentification::State::list_parameters(const Fit& current,
                                                   const std::optional<HuntCrossleyEstimate>& law,
                                                   const HuntCrossleyUncertainty& u,
                                                   const std::optional<CreepEstimate>& creep_found,
                                                   std::vector<EstimatedParameter>& parameters) const {
  if (recorded && current.surface) {
    const double offset = law ? law->contact_offset_mm : 0.0;
    const bool searched = law && std::isfinite(u.contact_offset_mm) && u.contact_offset_mm > 0.0;
    parameters.push_back({"contact_point_mm", "mm", current.surface->surface_mm - offset,
                          searched ? u.contact_offset_mm : current.surface->standard_error_mm});
  }
  if (wants_hunt_crossley() && law) {
    const HuntCrossleyParameters& p = law->parameters;
    parameters.push_back({"stiffness_n_per_mm_m", "N/mm^m", p.stiffness_n_per_mm_m, u.stiffness_n_per_mm_m});
    parameters.push_back(
        {"damping_n_s_per_mm_m1", "N s/mm^(m+1)", p.damping_n_s_per_mm_m1, u.damping_n_s_per_mm_m1});
    parameters.push_back({"exponent", "1", p.exponent, u.exponent});
  }
  if (wants_creep() && creep_found) {
    if (recorded && current.surface) {
      parameters.push_back(
          {"curve_surface_mm", "mm", current.surface->surface_mm, current.surface->standard_error_mm});
    }
    const CreepParameters& p = creep_found->law.parameters;
    for (std::size_t j = 0; j < p.weight.size(); ++j) {
      parameters.push_back({"weight_" + std::to_string(j), "1", p.weight[j], creep_found->weight_error[j]});
    }
    const double x = p.displacement_mm.back();
    parameters.push_back({"displacement_mm", "mm", x, creep_found->relative_displacement * x});
  }
}

MotionRequest ContactIdentification::next_request() const {
  State& s = *state_;
  if (s.recorded) return {};
  s.refresh();
  return next_palpation(s.fit.needs);
}

IdentificationProgress ContactIdentification::progress() const {
  State& s = *state_;
  s.refresh();
  const State::Fit& fit = s.fit;
  IdentificationProgress progress;
  progress.samples = s.kept.added();
  progress.duration_s = 1e-9 * static_cast<double>(s.last_ns - s.first_ns);
  s.list_parameters(fit, fit.hunt_crossley, fit.uncertainty, fit.creep, progress.parameters);
  const bool by_hunt_crossley = s.wants_hunt_crossley() && fit.hunt_crossley;
  progress.residual = by_hunt_crossley ? fit.uncertainty.residual
                      : fit.creep      ? fit.creep->residual
                                       : std::numeric_limits<double>::quiet_NaN();
  progress.coverage.push_back(fit.coverage);
  progress.fit_x = "displacement [mm]";
  progress.fit_y = "force [N]";
  if (fit.hunt_crossley) {
    const std::size_t every = fit.palpation.size() / kFitPoints + 1;
    for (std::size_t i = 0; i < fit.palpation.size(); i += every) {
      const PalpationSample& p = fit.palpation[i];
      progress.fit.push_back(
          {p.displacement_mm, p.normal_force_n,
           hunt_crossley_force_n(fit.hunt_crossley->parameters, p.displacement_mm, p.rate_mm_per_s)});
    }
  }
  progress.steady = fit.steady;
  progress.certain = fit.certain;
  progress.converged = fit.converged;
  progress.remarks = s.gate.remarks();
  const auto refused = palpation_refusal(s.extent, s.gate, s.task.threshold_n, s.recorded);
  if (refused && progress.duration_s > 2.0)
    progress.remarks.insert(progress.remarks.begin(), refused->what + ": " + refused->remedy);
  if (!fit.converged) progress.missing = missing_in_words(fit.needs);
  const double depth =
      s.task.force_n > 0.0 && !s.recorded ? std::min(1.0, s.largest_n / s.task.force_n) : 1.0;
  double done = s.contact_s > 0.0 ? 0.25 * depth + 0.45 * fit.coverage.share : 0.0;
  done += (fit.steady ? 0.13 : 0.0) + (fit.certain && fit.hunt_crossley ? 0.13 : 0.0);
  s.completion = std::max(s.completion, fit.converged ? 1.0 : std::min(0.99, done));
  progress.completion = s.completion;
  return progress;
}

hal::Result<IdentifiedModel> ContactIdentification::finish() const {
  State& s = *state_;
  if (auto refused = palpation_refusal(s.extent, s.gate, s.task.threshold_n, s.recorded)) return *refused;
  s.refresh();
  State::Fit fit = s.fit;
  const auto choice = s.choice(fit);
  const bool recursive =
      s.task.method == ContactFitMethod::kRecursive || s.task.method == ContactFitMethod::kDoubleStage;

  ContactModel contact;
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
    // What creeps need not be known where nothing does.
    fit.creep = creep;
    s.judge(fit);
  }
  const bool missing_law = (s.task.law && s.wants_hunt_crossley() && !contact.hunt_crossley) ||
                           (s.task.law && s.wants_creep() && !contact.creep);
  if (missing_law || (!contact.hunt_crossley && !contact.creep)) {
    const std::vector<std::string> missing = missing_in_words(fit.needs);
    return hal::Error{
        "the palpation does not determine the model's parameters", "identification of contact dynamics",
        std::to_string(s.kept.added()) + " samples in contact",
        "at least 100, at different depths and speeds",
        missing.empty() || s.recorded ? "press deeper, at several speeds, and for longer" : missing.front()};
  }
  IdentifiedModel model;
  model.content = contact;
  char text[160];
  std::snprintf(text, sizeof text, "%u contacts in %.1f s, up to %.3g N; %s",
                s.recorded ? s.recording.contacts() : s.tracker.contacts(),
                1e-9 * static_cast<double>(s.last_ns - s.first_ns), s.largest_n, words_of(s.task.method));
  model.procedure = text;
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
  if (auto bad = check(model)) return *bad;
  return model;
}

}  // namespace hapticd::rt
