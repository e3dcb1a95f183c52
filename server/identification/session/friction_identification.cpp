#include "server/identification/session/friction_identification.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "rt/signal/vector.h"
#include "server/identification/session/friction_plan.h"

namespace hapticd::identification {

namespace {

constexpr double kMinReactionN = 0.2;
/// A tip that is held by friction still moves a little against the encoders: at rest they show nothing.
constexpr double kMinStrokeSpeedMmPerS = 2.0;
constexpr double kPreslidingMmPerS = 40.0;

constexpr double kCertainLevel = 0.03;
constexpr double kCertainPresliding = 0.2;
constexpr std::size_t kFitPoints = 200;

double threshold_of(const FrictionTask& task) {
  return task.threshold_n > 0.0 ? task.threshold_n : FrictionTask{}.threshold_n;
}
double length_of(const FrictionTask& task) {
  return task.length_mm > 0.0 ? task.length_mm : FrictionTask{}.length_mm;
}

}  // namespace

FrictionIdentification::FrictionIdentification(const FrictionTask& task, const hal::RigInfo& rig)
    : IdentificationSession(friction_kind()),
      task_(task),
      rig_(rig),
      replay_(rig.kind == hal::RigKind::kReplay),
      sees_tip_(replay_ && rig.has_external_position),
      gate_(stroke_policy(rig)),
      scan_(threshold_of(task), rig),
      load_(rig.sensor.tool_mass_g, hal::Vector3{0.0, 0.0, -1.0}),
      motion_(std::max(rig.device.position_resolution_mm, 1e-4), rig.rate_hz),
      passages_(rig.device.position_resolution_mm),
      counts_(static_cast<std::size_t>(kSpeedBins * kForceBins), 0) {
  task_.length_mm = length_of(task);
}

void FrictionIdentification::add(const rt::Observation& observation) {
  const hal::RigSample& sample = observation.sample;
  const SampleGate::Verdict verdict = gate_.judge(sample);
  const double now_s = 1e-9 * static_cast<double>(sample.time_ns);
  if (verdict == SampleGate::Verdict::kSkip) {
    if (in_contact_ && (sample.status & hal::sample_status::kForceSaturated) != 0) effort_.saturate(now_s);
    return;
  }
  const hal::Vector3& tip_mm = sample.tip_position_mm;
  if (gate_.used() == 1) {
    begun_s_ = now_s;
    min_height_mm_ = max_height_mm_ = tip_mm.z;
    min_along_mm_ = max_along_mm_ = tip_mm.x;
  }
  last_s_ = now_s;
  min_height_mm_ = std::min(min_height_mm_, tip_mm.z);
  max_height_mm_ = std::max(max_height_mm_, tip_mm.z);
  min_along_mm_ = std::min(min_along_mm_, tip_mm.x);
  max_along_mm_ = std::max(max_along_mm_, tip_mm.x);
  if (verdict == SampleGate::Verdict::kRestart) {
    scan_.restart();
    motion_.reset();
    passages_.interrupt();
  }

  motion_.update(tip_mm, sample.time_ns);
  hal::Vector3 reaction_n = load_.without_weight_n(sample);
  if (rig_.sensor.tool_mass_g > 0.0) {
    reaction_n = reaction_n + load_.inertia_n(motion_.acceleration_mm_per_s2());
  }
  bool contact = true;
  if (replay_) {
    normal_recorded_ = normal_recorded_ || reaction_n.z != 0.0;
    if (task_.normal_force_n <= 0.0 && normal_recorded_) {
      contact = rt::norm(reaction_n) > 5.0 * threshold_of(task_);
    }
  } else {
    contact = scan_.add(sample) && rt::norm(reaction_n) > kMinReactionN;
  }
  if (!contact) {
    if (in_contact_) {
      passages_.interrupt();
      effort_.release();
    }
    in_contact_ = false;
    return;
  }
  in_contact_ = true;
  ++contact_samples_;
  const double speed_mm_per_s = std::abs(motion_.velocity_mm_per_s().x);
  effort_.touch(now_s, reaction_n.z, speed_mm_per_s > kSlidingStrokeMmPerS);
  count_coverage(reaction_n, speed_mm_per_s);
  passages_.add({now_s, tip_mm.x, tip_mm.z, reaction_n.x, reaction_n.z});
}

hal::Result<FrictionIdentification::Fit> FrictionIdentification::fit(bool exponent) const {
  constexpr double kMinMotionMm = 0.01;
  const double moved_mm = max_along_mm_ - min_along_mm_;
  if (gate_.used() < 20) {
    return refusal("too little data", std::to_string(gate_.used()) + " fit samples", "at least 20",
                   replay_ ? "record strokes back and forth" : next_request().words);
  }
  if (!(moved_mm > kMinMotionMm)) {
    return refusal("the tip did not move along the line", std::to_string(moved_mm) + " mm",
                   "strokes of more than " + std::to_string(kMinMotionMm) + " mm",
                   replay_ ? "check the column and the unit of the position" : next_request().words);
  }
  if (contact_samples_ == 0) {
    return refusal("nothing was touched", in_newton(0.0), "more than " + in_newton(kMinReactionN),
                   replay_ ? "check the column and the unit of the force" : next_request().words);
  }
  Fit fit;
  double constant_normal_n = 0.0;
  hal::Result<SurfaceSpline> surface = hal::Error{};
  if (!replay_) {
    surface = scan_.surface();
    fit.source = surface ? NormalSource::kScan : NormalSource::kMeanDirection;
  } else {
    constexpr double kCurvedMm = 0.5;
    constant_normal_n = task_.normal_force_n > 0.0 ? task_.normal_force_n
                        : normal_recorded_         ? 0.0
                                                   : kNominalNormalN;
    fit.nominal_normal = task_.normal_force_n <= 0.0 && !normal_recorded_;
    const bool curved = max_height_mm_ - min_height_mm_ > kCurvedMm && constant_normal_n == 0.0;
    fit.source = curved ? NormalSource::kMeanDirection : NormalSource::kFlat;
  }
  fit.rows = friction_rows(passages_.all(), fit.source, surface ? &*surface : nullptr, constant_normal_n,
                           unseen_turn_mm(rig_.device));
  if (fit.source == NormalSource::kScan && fit.rows.share_by_scan < 0.5) {
    fit.source = NormalSource::kMeanDirection;
  }
  if (surface) {
    constexpr int kLooks = 11;
    for (int i = 0; i < kLooks; ++i) {
      const double at_mm = surface->from_mm() + (surface->to_mm() - surface->from_mm()) * i / (kLooks - 1);
      const ProfileValue value = surface->at(at_mm);
      fit.normal_error_rad += value.slope_error / (1.0 + value.slope * value.slope) / kLooks;
    }
  }
  double min_n = std::numeric_limits<double>::infinity();
  double max_n = -min_n;
  for (const FrictionRow& row : fit.rows.rows) {
    min_n = std::min(min_n, row.friction_n);
    max_n = std::max(max_n, row.friction_n);
  }
  if (!fit.rows.rows.empty() && !(max_n - min_n > 1e-6)) {
    return refusal("the force along the line does not vary", std::to_string(max_n) + " N throughout",
                   "friction that turns with the motion", "check which column is the friction force");
  }
  FrictionFitOptions options;
  options.law = task_.tip == rt::Tip::kRod ? rt::FrictionLaw::kDahl : rt::FrictionLaw::kCoulombViscous;
  options.exponent = exponent && task_.tip == rt::Tip::kRod;
  if (!sees_tip_) options.max_exponent = 1.0;
  options.bias = replay_;
  options.doubt_viscous = replay_;
  const bool blind_at_rest = !replay_ || unseen_turn_mm(rig_.device) > 0.0;
  options.min_speed_mm_per_s = blind_at_rest ? kMinStrokeSpeedMmPerS : 0.0;
  if (!replay_) options.presliding_mm_per_s = kPreslidingMmPerS;
  options.sliding_mm_per_s = replay_ ? 0.2 * fit.rows.most_speed_mm_per_s : kSlidingStrokeMmPerS;
  hal::Result<FrictionLawFit> law = fit_friction_law(fit.rows.rows, options);
  if (!law) return law.error();
  fit.law = *law;
  fit.options = options;
  return fit;
}

hal::Result<FrictionIdentification::Fit> FrictionIdentification::with_maxwell_slip(Fit dahl) const {
  const hal::Result<MaxwellSlipFit> slip =
      fit_maxwell_slip(dahl.rows.rows, maxwell_slip_options(dahl.options));
  if (!slip) return slip.error();
  dahl.law.parameters = slip->friction();
  dahl.law.bias_n = slip->bias_n;
  dahl.law.residual = slip->residual;
  dahl.options.exponent = false;
  return dahl;
}

void FrictionIdentification::refit() const {
  if (passages_.completed() == fitted_passages_ && (fitted_ || failed_)) return;
  hal::Result<Fit> next = fit(task_.exponent);
  fitted_passages_ = passages_.completed();
  if (!next) {
    failed_ = next.error();
    return;
  }
  failed_.reset();
  // However often it is asked for: a passage more changes little by itself.
  if (!reference_) {
    reference_ = Reference{next->law.parameters, fitted_passages_};
  } else if (fitted_passages_ > reference_->passages + 2) {
    const rt::FrictionParameters& a = reference_->parameters;
    const rt::FrictionParameters& b = next->law.parameters;
    change_ = std::abs(b.kinetic / a.kinetic - 1.0);
    // The presliding distance is known three times as badly and matters a third as much.
    if (task_.tip == rt::Tip::kRod) {
      change_ = std::max(change_, std::abs(b.presliding_mm / a.presliding_mm - 1.0) / 3.0);
    }
    reference_ = Reference{b, fitted_passages_};
  }
  if (replay_) change_ = 0.0;  // it is over; what it shows does not change any more
  fitted_ = std::move(*next);
}

bool FrictionIdentification::certain(const Fit& fit) const {
  const rt::FrictionParameters& p = fit.law.parameters;
  const rt::FrictionParameters& e = fit.law.error;
  return e.kinetic < kCertainLevel * p.kinetic &&
         (task_.tip != rt::Tip::kRod || e.presliding_mm < kCertainPresliding * p.presliding_mm);
}

void FrictionIdentification::find(IdentificationProgress& progress) const {
  refit();
  progress.samples = contact_samples_;
  progress.duration_s = last_s_ - begun_s_;
  progress.coverage.push_back(conditions());
  const bool covered = lacking_force_row() < 0 && (replay_ || scanned());
  if (fitted_) {
    progress.parameters = parameters_of(*fitted_);
    progress.residual = fitted_->law.residual;
    progress.certain = certain(*fitted_);
    progress.steady = change_ < kSteady;
    const std::vector<FrictionRow>& rows = fitted_->rows.rows;
    const rt::FrictionLaw law =
        task_.tip == rt::Tip::kRod ? rt::FrictionLaw::kDahl : rt::FrictionLaw::kCoulombViscous;
    const std::vector<double> model =
        predicted_friction_n(rows, fitted_->law.parameters, law, fitted_->law.bias_n);
    const std::size_t stride = rows.size() / kFitPoints + 1;
    for (std::size_t i = 0; i < rows.size(); i += stride) {
      progress.fit.push_back({rows[i].along_mm, rows[i].friction_n, model[i]});
    }
  }
  progress.converged = covered && !failed_;
  progress.missing = missing(progress.steady, progress.certain);
  progress.remarks = remarks(fitted_ ? &*fitted_ : nullptr);
  double done = 0.0;
  if (replay_) {
    done = progress.certain ? 1.0 : 0.0;
  } else {
    const double share_of_taps =
        std::min(1.0, static_cast<double>(scan_.touches().size()) / static_cast<double>(scan_taps()));
    done = 0.25 * (scanned() ? 1.0 : share_of_taps) + 0.55 * progress.coverage.front().share +
           (progress.certain ? 0.1 : 0.0) + (progress.steady && progress.certain ? 0.1 : 0.0);
  }
  progress.completion = std::min(done, 0.99);
}

std::optional<hal::Error> FrictionIdentification::conclude(const IdentificationProgress& /*now*/,
                                                           rt::IdentifiedModel& model) const {
  hal::Result<Fit> found = fit(task_.exponent);
  if (!found) return found.error();
  const bool chooses = task_.tip == rt::Tip::kRod && !task_.exponent && !task_.exponent_is_one;
  std::optional<FrictionLawChoice> choice;
  if (chooses) {
    choice = choose_friction_law(found->rows.rows, found->options);
    if (choice->form() == FrictionForm::kMaxwellSlip) found = with_maxwell_slip(*found);
    if (choice->form() == FrictionForm::kDahlExponent) found = fit(true);
    if (!found) return found.error();
  }
  model.content = rt::FrictionModel{task_.tip, found->law.parameters};
  model.parameters = parameters_of(*found);
  model.residual = found->law.residual;
  model.procedure = found->law.parameters.maxwell_slip ? "Maxwell-slip law"
                    : task_.tip == rt::Tip::kRod       ? "Dahl's law"
                                                       : "Coulomb-viscous law";
  model.procedure +=
      found->law.divided ? ", sliding and presliding apart" : ", sliding and presliding together";
  for (const std::string& remark : remarks(&*found)) model.procedure += "; " + remark;
  if (choice) {
    model.procedure += words_of(choice->form());
    for (const auto& [name, error] : {std::pair{"held_out_dahl", choice->dahl},
                                      {"held_out_dahl_exponent", choice->dahl_exponent},
                                      {"held_out_maxwell_slip", choice->maxwell_slip}}) {
      if (std::isfinite(error.relative))
        model.parameters.push_back({name, "1", error.relative, error.deviation});
    }
  }
  model.validity.max_force_n = found->rows.max_normal_n;
  model.validity.max_speed_mm_per_s = found->rows.most_speed_mm_per_s;
  return std::nullopt;
}

}  // namespace hapticd::identification
