#include "server/identification/session/friction_identification.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "rt/signal/vector.h"

namespace hapticd::rt {

namespace {

constexpr double kTapSpacingMm = 2.5;
constexpr double kTapMmPerS = 40.0;
constexpr double kStrokePeakMmPerS = 110.0;
constexpr double kCalmPeakMmPerS = 60.0;  // turns of the rod show presliding best when nothing bends
constexpr double kForceRateNPerS = 6.0;
// Strokes overshoot, a tip deep in a curved object is nearest to places farther out, and a profile is known
// worst at its ends.
constexpr double kScanBeyondMm = 8.0;
constexpr double kMinReactionN = 0.2;
/// A tip that is held by friction still moves a little against the encoders: at rest they say nothing.
constexpr double kMinStrokeSpeedMmPerS = 2.0;
constexpr double kSlidingStrokeMmPerS = 10.0;
constexpr double kPreslidingMmPerS = 40.0;

// The plane of conditions: what strokes up to 110 mm/s at three forces visit.
constexpr int kSpeedBins = 3;
constexpr double kMaxSpeedMmPerS = 120.0;
constexpr int kForceBins = 3;
constexpr double kMaxForceN = 6.0;
constexpr double kStrokeForceN[kForceBins] = {1.2, 3.0, 5.0};
constexpr std::uint32_t kEnoughPerCell = 50;

constexpr double kCertainLevel = 0.03;
constexpr double kCertainPresliding = 0.2;
constexpr double kSteady = 0.03;
constexpr std::size_t kFitPoints = 200;

double threshold_of(const FrictionTask& task) {
  return task.threshold_n > 0.0 ? task.threshold_n : FrictionTask{}.threshold_n;
}
double length_of(const FrictionTask& task) {
  return task.length_mm > 0.0 ? task.length_mm : FrictionTask{}.length_mm;
}

const char* words_of(NormalSource source) {
  switch (source) {
    case NormalSource::kScan:
      return "normals from a scan of the surface";
    case NormalSource::kMeanDirection:
      return "normals from the mean direction of the reaction back and forth";
    case NormalSource::kFlat:
      break;
  }
  return "normals taken as straight up";
}

const char* words_of(FrictionForm form) {
  switch (form) {
    case FrictionForm::kMaxwellSlip:
      return "; Maxwell-slip elements: held-out strokes ask for them";
    case FrictionForm::kDahlExponent:
      return "; exponent found: held-out strokes ask for it";
    case FrictionForm::kDahl:
      break;
  }
  return "; exponent 1: held-out strokes ask for no other";
}

std::string in_newton(double force_n) {
  std::string text = std::to_string(force_n);
  return text.substr(0, text.find('.') + 2) + " N";
}

}  // namespace

FrictionIdentification::FrictionIdentification(const FrictionTask& task, const hal::RigInfo& rig)
    : task_(task),
      rig_(rig),
      replay_(rig.kind == hal::RigKind::kReplay),
      gate_(stroke_policy(rig)),
      scan_(threshold_of(task), rig),
      load_(rig.sensor.tool_mass_g, hal::Vector3{0.0, 0.0, -1.0}),
      motion_(std::max(rig.device.position_resolution_mm, 1e-4), rig.rate_hz),
      passages_(rig.device.position_resolution_mm),
      counts_(static_cast<std::size_t>(kSpeedBins * kForceBins), 0) {
  task_.length_mm = length_of(task);
}

void FrictionIdentification::add(const Observation& observation) {
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
    least_height_mm_ = most_height_mm_ = tip_mm.z;
    least_along_mm_ = most_along_mm_ = tip_mm.x;
  }
  last_s_ = now_s;
  least_height_mm_ = std::min(least_height_mm_, tip_mm.z);
  most_height_mm_ = std::max(most_height_mm_, tip_mm.z);
  least_along_mm_ = std::min(least_along_mm_, tip_mm.x);
  most_along_mm_ = std::max(most_along_mm_, tip_mm.x);
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
      contact = norm(reaction_n) > 5.0 * threshold_of(task_);
    }
  } else {
    contact = scan_.add(sample) && norm(reaction_n) > kMinReactionN;
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

void FrictionIdentification::count_coverage(const hal::Vector3& reaction_n, double speed_mm_per_s) {
  if (!(speed_mm_per_s > kSlidingStrokeMmPerS)) return;
  const double force_n = task_.normal_force_n > 0.0 && replay_ ? task_.normal_force_n : reaction_n.z;
  most_force_n_ = std::max(most_force_n_, force_n);
  most_speed_mm_per_s_ = std::max(most_speed_mm_per_s_, speed_mm_per_s);
  const double column = speed_mm_per_s / kMaxSpeedMmPerS * kSpeedBins;
  const double row = force_n / kMaxForceN * kForceBins;
  if (!(column < kSpeedBins && row >= 0.0 && row < kForceBins)) return;
  std::uint32_t& count =
      counts_[static_cast<std::size_t>(static_cast<int>(row) * kSpeedBins + static_cast<int>(column))];
  if (count < std::numeric_limits<std::uint32_t>::max()) ++count;
}

Coverage FrictionIdentification::coverage() const {
  Coverage coverage;
  coverage.x = {"sliding speed", "mm/s", 0.0, kMaxSpeedMmPerS, kSpeedBins};
  coverage.y = {"normal force", "N", 0.0, kMaxForceN, kForceBins};
  coverage.counts = counts_;
  coverage.required.assign(counts_.size(), 0);  // a recording can be asked for nothing
  for (std::size_t i = 0; i < counts_.size() && !replay_; ++i) {
    coverage.required[i] = asks_for_row(static_cast<int>(i) / kSpeedBins) ? 1 : 0;
  }
  coverage.enough_samples = kEnoughPerCell;
  coverage.update_share();
  return coverage;
}

/// Not where all of the row is more than the tip slides under, or than the sensor bears.
bool FrictionIdentification::asks_for_row(int row) const {
  return row == 0 || effort_.limit_n() >= row * kMaxForceN / kForceBins;
}

int FrictionIdentification::lacking_force_row() const {
  if (replay_) return -1;
  for (std::size_t i = 0; i < counts_.size(); ++i) {
    if (asks_for_row(static_cast<int>(i) / kSpeedBins) && counts_[i] < kEnoughPerCell)
      return static_cast<int>(i) / kSpeedBins;
  }
  return -1;
}

int FrictionIdentification::scan_taps() const {
  return std::clamp(
      static_cast<int>(std::lround((task_.length_mm + 2.0 * kScanBeyondMm) / kTapSpacingMm)) + 1, 7, 61);
}

bool FrictionIdentification::scanned() const {
  // A tap now and then may fail; the spline bridges one.
  const double half_mm = 0.5 * task_.length_mm + kScanBeyondMm;
  const double widest_mm = 2.5 * 2.0 * half_mm / (scan_taps() - 1);
  double last_mm = -half_mm;
  for (const ProfilePoint& touch : scan_.touches()) {
    if (touch.along_mm - last_mm > widest_mm) return false;
    last_mm = std::max(last_mm, touch.along_mm);
    if (last_mm > half_mm) break;
  }
  return half_mm - last_mm < widest_mm && scan_.touches().size() >= static_cast<std::size_t>(scan_taps()) / 2;
}

MotionRequest FrictionIdentification::next_request() const {
  MotionRequest request;
  if (replay_) return request;
  request.place_mm.x = -0.5 * task_.length_mm;
  request.length_mm = task_.length_mm;
  if (!scanned()) {
    request.motion = MotionRequest::Motion::kLightTaps;
    request.repetitions = scan_taps();
    request.place_mm.x -= kScanBeyondMm;
    request.length_mm += 2.0 * kScanBeyondMm;
    request.speed_mm_per_s = kTapMmPerS;
    request.words = "touch lightly at " + std::to_string(request.repetitions) + " places along a line of " +
                    std::to_string(std::lround(request.length_mm)) + " mm, to scan the surface";
    return request;
  }
  refit();
  const int row = lacking_force_row();
  if (row < 0 && fitted_ && certain(*fitted_) && change_ < kSteady) return request;
  // Calm strokes first, and again where all is covered but not known well enough.
  constexpr std::uint64_t kCalmPassages = 3;
  const bool calm = task_.tip == Tip::kRod && (passages_.completed() < kCalmPassages || row < 0);
  const int force = passages_.completed() < kCalmPassages ? kForceBins / 2
                    : row < 0 ? static_cast<int>(passages_.completed() % kForceBins)
                              : row;
  request.motion = MotionRequest::Motion::kStroke;
  request.force_n = effort_.asked_n(kStrokeForceN[force], kStrokeForceN[0]);
  request.force_rate_n_per_s = kForceRateNPerS;
  request.speed_mm_per_s = calm ? kCalmPeakMmPerS : kStrokePeakMmPerS;
  request.repetitions = 2;
  request.words = "stroke back and forth along the line, pressing with about " + in_newton(request.force_n) +
                  ", up to " + std::to_string(std::lround(request.speed_mm_per_s)) + " mm/s";
  return request;
}

hal::Result<FrictionIdentification::Fit> FrictionIdentification::fit(bool exponent) const {
  const auto refuse = [&](const std::string& what, const std::string& value, const std::string& limit,
                          const std::string& remedy) {
    return hal::Error{what, "identification of friction", value, limit, remedy};
  };
  constexpr double kMinMotionMm = 0.01;
  const double moved_mm = most_along_mm_ - least_along_mm_;
  if (gate_.used() < 20) {
    return refuse("too little data", std::to_string(gate_.used()) + " fit samples", "at least 20",
                  replay_ ? "record strokes back and forth" : next_request().words);
  }
  if (!(moved_mm > kMinMotionMm)) {
    return refuse("the tip did not move along the line", std::to_string(moved_mm) + " mm",
                  "strokes of more than " + std::to_string(kMinMotionMm) + " mm",
                  replay_ ? "check the column and the unit of the position" : next_request().words);
  }
  if (contact_samples_ == 0) {
    return refuse("nothing was touched", in_newton(0.0), "more than " + in_newton(kMinReactionN),
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
    const bool curved = most_height_mm_ - least_height_mm_ > kCurvedMm && constant_normal_n == 0.0;
    fit.source = curved ? NormalSource::kMeanDirection : NormalSource::kFlat;
  }
  fit.rows = friction_rows(passages_.all(), fit.source, surface ? &*surface : nullptr, constant_normal_n);
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
  double least_n = std::numeric_limits<double>::infinity();
  double most_n = -least_n;
  for (const FrictionRow& row : fit.rows.rows) {
    least_n = std::min(least_n, row.friction_n);
    most_n = std::max(most_n, row.friction_n);
  }
  if (!fit.rows.rows.empty() && !(most_n - least_n > 1e-6)) {
    return refuse("the force along the line does not vary", std::to_string(most_n) + " N throughout",
                  "friction that turns with the motion", "check which column is the friction force");
  }
  FrictionFitOptions options;
  options.law = task_.tip == Tip::kRod ? FrictionLaw::kDahl : FrictionLaw::kCoulombViscous;
  options.exponent = exponent && task_.tip == Tip::kRod;
  options.bias = replay_;
  options.doubt_viscous = replay_;
  options.least_speed_mm_per_s = replay_ ? 0.0 : kMinStrokeSpeedMmPerS;
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
    const FrictionParameters& a = reference_->parameters;
    const FrictionParameters& b = next->law.parameters;
    change_ = std::abs(b.kinetic / a.kinetic - 1.0);
    // The presliding distance is known three times as badly and matters a third as much.
    if (task_.tip == Tip::kRod) {
      change_ = std::max(change_, std::abs(b.presliding_mm / a.presliding_mm - 1.0) / 3.0);
    }
    reference_ = Reference{b, fitted_passages_};
  }
  if (replay_) change_ = 0.0;  // it is over; what it shows does not change any more
  fitted_ = std::move(*next);
}

bool FrictionIdentification::certain(const Fit& fit) const {
  const FrictionParameters& p = fit.law.parameters;
  const FrictionParameters& e = fit.law.error;
  return e.kinetic < kCertainLevel * p.kinetic &&
         (task_.tip != Tip::kRod || e.presliding_mm < kCertainPresliding * p.presliding_mm);
}

std::vector<EstimatedParameter> FrictionIdentification::parameters_of(const Fit& fit) const {
  const FrictionParameters& p = fit.law.parameters;
  const FrictionParameters& e = fit.law.error;
  std::vector<EstimatedParameter> list{{"kinetic", "1", p.kinetic, e.kinetic}};
  if (task_.tip == Tip::kRod) {
    list.push_back({"presliding_mm", "mm", p.presliding_mm, e.presliding_mm});
    if (fit.options.exponent) list.push_back({"exponent", "1", p.exponent, e.exponent});
    if (p.maxwell_slip) {
      const auto& reaches = p.maxwell_slip->reach_mm;
      const auto elements = std::count_if(reaches.begin(), reaches.end(), [](double mm) { return mm > 0.0; });
      list.push_back({"maxwell_slip_elements", "1", static_cast<double>(elements), 0.0});
    }
  }
  list.push_back({"viscous_n_s_per_mm", "N·s/mm", p.viscous_n_s_per_mm, e.viscous_n_s_per_mm});
  if (replay_) list.push_back({"force_bias_n", "N", fit.law.bias_n, fit.law.bias_error_n});
  const double normal_n = fit.nominal_normal ? kNominalNormalN : task_.normal_force_n;
  if (replay_ && normal_n > 0.0) {
    list.push_back({"coulomb_force_n", "N", p.kinetic * normal_n, e.kinetic * normal_n});
  }
  return list;
}

std::vector<std::string> FrictionIdentification::missing(bool steady, bool is_certain) const {
  std::vector<std::string> words;
  if (!replay_) {
    if (!scanned()) {
      words.push_back(next_request().words);
    } else {
      for (int row = 0; row < kForceBins; ++row) {
        if (!asks_for_row(row)) continue;
        double lacks_mm_per_s = 0.0;
        for (int column = kSpeedBins - 1; column >= 0 && lacks_mm_per_s == 0.0; --column) {
          if (counts_[static_cast<std::size_t>(row * kSpeedBins + column)] < kEnoughPerCell) {
            lacks_mm_per_s = (column + 0.8) * kMaxSpeedMmPerS / kSpeedBins;
          }
        }
        if (lacks_mm_per_s == 0.0) continue;
        words.push_back("stroke with about " + in_newton(kStrokeForceN[row]) + " at up to " +
                        std::to_string(std::lround(lacks_mm_per_s)) + " mm/s");
      }
    }
  }
  if (failed_) words.push_back(failed_->what + (failed_->remedy.empty() ? "" : ": " + failed_->remedy));
  if (fitted_ && !is_certain) words.push_back("turn more often: friction is not known well enough yet");
  if (fitted_ && is_certain && !steady) words.push_back("go on stroking: the parameters still change");
  return words;
}

std::vector<std::string> FrictionIdentification::remarks(const Fit* fit) const {
  std::vector<std::string> words = gate_.remarks();
  if (passages_.given_up() > 0) {
    words.push_back(std::to_string(passages_.given_up()) +
                    " passages of a sort of which there are many were given up to bound memory");
  }
  if (!asks_for_row(kForceBins - 1)) {
    words.push_back("the tip stuck or the sensor was at its end under hard strokes: none of more than " +
                    in_newton(std::max(effort_.limit_n(), kStrokeForceN[0])) + " are asked for");
  }
  if (fit == nullptr) return words;
  words.push_back(words_of(fit->source));
  if (fit->source == NormalSource::kScan) {
    words.back() += ", known to " + std::to_string(fit->normal_error_rad) + " rad";
    if (fit->rows.share_by_scan < 0.995) {
      words.push_back(std::to_string(std::lround(100.0 * (1.0 - fit->rows.share_by_scan))) +
                      " % of the strokes lay outside of the scan");
    }
  }
  if (fit->nominal_normal) {
    words.push_back(
        "no normal force was recorded: coulomb_force_n is what was found, coefficients refer to a "
        "nominal " +
        in_newton(kNominalNormalN));
  }
  if (!fit->law.divided && task_.tip == Tip::kRod) {
    words.push_back("no stroke slid farther than 3 mm: sliding and presliding were fitted together");
  }
  if (!fit->law.viscous_is_identified)
    words.push_back("the speed varied too little to determine the viscous part: taken as 0");
  return words;
}

IdentificationProgress FrictionIdentification::progress() const {
  refit();
  IdentificationProgress progress;
  progress.samples = contact_samples_;
  progress.duration_s = last_s_ - begun_s_;
  progress.residual = std::numeric_limits<double>::quiet_NaN();
  progress.coverage.push_back(coverage());
  progress.fit_x = "position along the line [mm]";
  progress.fit_y = "friction [N]";
  const bool covered = lacking_force_row() < 0 && (replay_ || scanned());
  if (fitted_) {
    progress.parameters = parameters_of(*fitted_);
    progress.residual = fitted_->law.residual;
    progress.certain = certain(*fitted_);
    progress.steady = change_ < kSteady;
    const std::vector<FrictionRow>& rows = fitted_->rows.rows;
    const FrictionLaw law = task_.tip == Tip::kRod ? FrictionLaw::kDahl : FrictionLaw::kCoulombViscous;
    const std::vector<double> model =
        predicted_friction_n(rows, fitted_->law.parameters, law, fitted_->law.bias_n);
    const std::size_t stride = rows.size() / kFitPoints + 1;
    for (std::size_t i = 0; i < rows.size(); i += stride) {
      progress.fit.push_back({rows[i].along_mm, rows[i].friction_n, model[i]});
    }
  }
  progress.converged = progress.certain && progress.steady && covered && !failed_;
  if (!progress.converged) progress.missing = missing(progress.steady, progress.certain);
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
  completion_ = std::max(completion_, progress.converged ? 1.0 : std::min(done, 0.99));
  progress.completion = completion_;
  return progress;
}

hal::Result<IdentifiedModel> FrictionIdentification::finish() const {
  const IdentificationProgress last = progress();
  hal::Result<Fit> found = fit(task_.exponent);
  if (!found) return found.error();
  const bool chooses = task_.tip == Tip::kRod && !task_.exponent && !task_.exponent_is_one;
  std::optional<FrictionLawChoice> choice;
  if (chooses) {
    choice = choose_friction_law(found->rows.rows, found->options);
    if (choice->form() == FrictionForm::kMaxwellSlip) found = with_maxwell_slip(*found);
    if (choice->form() == FrictionForm::kDahlExponent) found = fit(true);
    if (!found) return found.error();
  }
  IdentifiedModel model;
  model.content = FrictionModel{task_.tip, found->law.parameters};
  model.parameters = parameters_of(*found);
  model.residual = found->law.residual;
  model.converged = last.converged;
  model.procedure = found->law.parameters.maxwell_slip ? "Maxwell-slip law"
                    : task_.tip == Tip::kRod           ? "Dahl's law"
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
  model.validity.max_force_n = found->rows.most_normal_n;
  model.validity.max_speed_mm_per_s = found->rows.most_speed_mm_per_s;
  if (auto error = check(model)) {
    error->remedy = "check unit and column of force and position, or stroke again";
    return *error;
  }
  return model;
}

}  // namespace hapticd::rt
