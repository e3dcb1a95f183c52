#include "server/identification/session/structural_identification.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "rt/signal/vector.h"
#include "server/identification/session/fixed_text.h"

namespace hapticd::identification {

namespace {

constexpr double kWindowS = 0.016;  // of a velocity; recordings may have slower ticks
constexpr double kFreeAfterS = 0.15;
constexpr double kRigidDeviceN = 5.0;         // of the device; a press counts from half of this on
constexpr double kPressOverContinuous = 3.0;  // force of a press on a wall, against what is borne for ever
constexpr double kRigidOverContinuous = 2.5;

/// 4 … 16: beyond 1 kHz a window of 17 ticks does.
std::size_t ticks_in(double duration_s, double rate_hz) noexcept {
  return static_cast<std::size_t>(std::clamp(std::round(duration_s * rate_hz), 4.0, 16.0));
}

}  // namespace

StructuralIdentification::StructuralIdentification(const StructuralStiffnessTask& task,
                                                   const hal::RigInfo& rig)
    : IdentificationSession(structural_kind()),
      task_(task),
      rig_(rig),
      // As hard as a hand does without haste, and well within what the device gives.
      press_force_n_(std::min(task.rigid_contact ? kRigidDeviceN : 8.0,
                              rig.device.max_force_n > 0.0 ? 0.8 * rig.device.max_force_n : 6.0)),
      window_ticks_(ticks_in(kWindowS, rig.rate_hz) / 2 * 2 + 1),
      free_rows_after_(static_cast<int>(std::lround(std::clamp(kFreeAfterS * rig.rate_hz, 3.0, 150.0)))),
      gate_(structural_policy(rig, task.rigid_contact)) {
  if (task_.rigid_contact) task_.constant = true;
  if (rig.kind == hal::RigKind::kHardware && rig.device.max_continuous_force_n > 0.0) {
    press_force_n_ =
        std::min(press_force_n_, (task_.rigid_contact ? kRigidOverContinuous : kPressOverContinuous) *
                                     rig.device.max_continuous_force_n);
  }
  before_.resize(kBefore);
  presses_.reserve(kMaxPresses);
  if (task_.rigid_contact) return;
  const auto place = [&](double x, double y, double z) {
    targets_mm_.push_back({x * kAsideMm, y * kAcrossMm, kMiddleMm + z * kUpDownMm});
  };
  place(0, 0, 0);
  if (task_.constant) {
    place(-1, 0, 0), place(1, 0, 0), place(0, 0, 1), place(0, -1, -1);
    return;
  }
  // Central composite design: centre, faces and corners of the box.
  for (const double s : {-1.0, 1.0}) place(s, 0, 0), place(0, s, 0), place(0, 0, s);
  for (const double x : {-1.0, 1.0}) {
    for (const double y : {-1.0, 1.0}) place(x, y, -1), place(x, y, 1);
  }
}

void StructuralIdentification::add(const rt::Observation& observation) {
  const hal::RigSample& sample = observation.sample;
  const bool rigid = task_.rigid_contact;
  if (gate_.refuse(observation)) {
    window_count_ = 0;
    return;
  }
  warm_up(observation);
  if (!rigid && (!observation.has_external_position || !finite(observation.external_position_mm))) {
    ++outside_missing_;
    gate_.forget();
    window_count_ = 0;
    return;
  }
  const Raw raw{sample.time_ns, sample.tip_position_mm,
                rigid ? hal::Vector3{} : observation.external_position_mm, observation.device_command_n,
                rigid ? rt::norm(sample.sensor_force_n) : 0.0};
  greatest_force_n_ = std::max(greatest_force_n_, rt::norm(raw.force_n));
  const SampleGate::Verdict verdict = gate_.follow(observation);
  if (verdict == SampleGate::Verdict::kSkip) return;
  if (verdict == SampleGate::Verdict::kRestart) {
    window_count_ = 0;
  } else if (window_count_ > 0) {
    const Raw& last = window_[(window_next_ + window_ticks_ - 1) % window_ticks_];
    if ((!rigid || rt::norm(raw.force_n) > kSettledN) &&
        rt::norm((raw.outside_mm - raw.encoder_mm) - (last.outside_mm - last.encoder_mm)) > 1.0) {
      ++jumps_;  // one wild reading of either instrument; under force no structure bends so fast
      window_count_ = 0;
    }
  }
  window_[window_next_] = raw;
  window_next_ = (window_next_ + 1) % window_ticks_;
  if (window_count_ < window_ticks_) ++window_count_;
  if (window_count_ < window_ticks_) return;

  const Raw& oldest = window_[window_next_];
  const Raw& middle = window_[(window_next_ + window_ticks_ / 2) % window_ticks_];
  const double per_s = 1.0 / (1e-9 * static_cast<double>(raw.time_ns - oldest.time_ns));
  Row row;
  row.deflection_mm = middle.outside_mm - middle.encoder_mm;
  row.force_n = middle.force_n;
  row.reaction_n = middle.reaction_n;
  row.force_rate_n_per_s = (raw.force_n - oldest.force_n) * per_s;
  row.velocity_mm_per_s = (raw.encoder_mm - oldest.encoder_mm) * per_s;
  row.place_mm = middle.encoder_mm;
  take(row);
}

StructuralFit StructuralIdentification::fit(int highest_order) const {
  std::vector<const StructuralPress*> presses;
  for (const Press& press : presses_) presses.push_back(&press);
  return fit_structural(presses, highest_order, rig_.rate_hz);
}

StructuralIdentification::RigidBounds StructuralIdentification::bounds_of(
    const rt::StructuralModel& model) const noexcept {
  RigidBounds bounds;
  double device_n = 0.0, object_n = 0.0;
  for (const Press& press : presses_) {
    device_n += press.force_n;
    object_n += press.reaction_n;
  }
  // Without a sensor the hand is taken to be off: the device alone presses.
  if (device_n > 0.0) bounds.reaction_ratio = std::max(1.0, object_n / device_n);
  const double found = 1.0 / model.stiffness_n_per_mm;
  const double hidden = bounds.reaction_ratio / task_.least_object_stiffness_n_per_mm;
  if (hidden < found) bounds.upper_n_per_mm = 1.0 / (found - hidden);
  bounds.relative_error = hidden / found;
  return bounds;
}

std::vector<rt::EstimatedParameter> StructuralIdentification::parameters_of(const StructuralFit& fit) const {
  std::vector<rt::EstimatedParameter> parameters = fit.parameters;
  if (!task_.rigid_contact) return parameters;
  const RigidBounds bounds = bounds_of(fit.model);
  rt::EstimatedParameter& stiffness = parameters.front();
  stiffness.standard_error = std::hypot(stiffness.standard_error, bounds.relative_error * stiffness.value);
  if (std::isfinite(bounds.upper_n_per_mm)) {
    parameters.push_back(
        {"structural_stiffness_upper_n_per_mm", "N/mm", bounds.upper_n_per_mm, stiffness.standard_error});
  }
  parameters.push_back(
      {"least_object_stiffness_n_per_mm", "N/mm", task_.least_object_stiffness_n_per_mm, 0.0});
  parameters.push_back({"object_force_over_device_force", "1", bounds.reaction_ratio, 0.0});
  return parameters;
}

void StructuralIdentification::find(IdentificationProgress& progress) const {
  progress.samples = rows_used_;
  progress.duration_s = gate_.watched_s();
  const StructuralFit now = fit(task_.constant ? 0 : 2);
  const std::size_t done = pressed_enough();
  const std::size_t wanted = wanted_presses();
  const bool rigid = task_.rigid_contact;

  if (!task_.rigid_contact) progress.coverage = places();  // it is where it is: no places to visit
  if (now.good) {
    progress.parameters = parameters_of(now);
    progress.residual = now.residual;
    const std::size_t first = presses_.size() > 50 ? presses_.size() - 50 : 0;
    for (std::size_t p = first; p < presses_.size(); ++p) {
      for (std::size_t i = 0; i < presses_[p].point_count; ++i) {
        FitPoint point = presses_[p].points[i];
        point.model = -(point.x - presses_[p].points_zero_n) / now.model.stiffness_at(presses_[p].place_mm);
        progress.fit.push_back(point);
      }
    }
    if (history_.size() >= 3) {
      const auto [low, high] = std::minmax_element(history_.end() - 3, history_.end());
      // The places differ where the stiffness does; a field's own steadiness is its standard errors.
      progress.steady = !task_.constant || *high - *low < 0.01 * *high;
    }
    progress.certain = now.centre_error < (rigid ? kEnoughRigidError : kEnoughComplianceError) &&
                       (task_.constant || (now.order == 2 && now.worst_error < kEnoughFieldError));
  }
  progress.converged = done == wanted;
  progress.completion = 0.95 * static_cast<double>(done) / static_cast<double>(wanted);
  progress.missing = missing(now, progress.certain, progress.steady);
  progress.remarks = remarks(now);
}

hal::Result<rt::IdentifiedModel> StructuralIdentification::finish() const {
  if (!pressing_) return IdentificationSession::finish();
  StructuralIdentification closed(*this);  // the data end in a press: it counts as far as possible
  closed.close_press();
  return closed.finish();
}

std::optional<hal::Error> StructuralIdentification::conclude(const IdentificationProgress& /*now*/,
                                                             rt::IdentifiedModel& model) const {
  const bool rigid = task_.rigid_contact;
  if (gate_.judged() == 0) {
    return refusal("no data", "0 samples", "", rigid ? "press a rigid object" : "press virtual walls");
  }
  if (outside_missing_ == gate_.judged()) {
    return refusal("no external instrument measures the tip's position", "",
                   "an external displacement reading next to the encoders (4.26)",
                   "the encoders cannot see the device bend: mount one, e.g. an LVDT of 30 µm");
  }
  const StructuralFit now = fit(task_.constant ? 0 : 2);
  if (!now.good && 2 * outside_missing_ > gate_.judged()) {
    return refusal(
        "the instrument from outside gave no reading most of the time",
        std::to_string(outside_missing_) + " of " + std::to_string(gate_.judged()) + " samples",
        "a reading in most samples",
        "see in 'hapticctl status' whether its input is at the end of its range: it has to see the tip at "
        "all the places that are pressed");
  }
  if (!now.good) {
    const std::string seen = std::to_string(presses_.size()) +
                             " presses beyond 0.5 N; the greatest force is " +
                             fixed_text(greatest_force_n_, 3) + " N";
    const std::string check = rigid ? "check the signs and units of force and position"
                                    : "check the signs and units of force and external position";
    std::string remedy = check;
    if (rig_.kind != hal::RigKind::kReplay) {
      if (gives_way()) {
        remedy = "the object gives way: press " + rigid_object();
      } else if (presses_.empty()) {
        remedy = next_request().words;
      }
    }
    return refusal("no press determines the stiffness", seen,
                   rigid ? "presses of the device, changing by up to 80 N/s, under which the encoders follow "
                           "the force by more than 1 mm/s"
                         : "presses on virtual walls, moving by more than 3 mm/s and changing by up to 80 "
                           "N/s, with a deflection that grows against the force",
                   std::move(remedy));
  }
  if (now.residual > 0.9) {
    return refusal("the deflection does not follow the force",
                   "residual " + fixed_text(100.0 * now.residual, 0) + " % of what was measured",
                   "below 90 %",
                   rigid ? "check that the tip stays on the object, and the signs and units of force and "
                           "position"
                         : "check that the instrument watches the tip and has the encoders' frame and "
                           "units");
  }
  if (rigid && !std::isfinite(bounds_of(now.model).upper_n_per_mm)) {
    return refusal("the object may give way as much as the device",
                   "found " + fixed_text(now.model.stiffness_n_per_mm, 2) + " N/mm, with an object of " +
                       fixed_text(task_.least_object_stiffness_n_per_mm, 0) + " N/mm or more",
                   "an object much stiffer than the device",
                   "press on a block of " + rigid_object() +
                       ", and say how stiff it is at least "
                       "(least_object_stiffness_n_per_mm)");
  }
  model.content = now.model;
  if (rigid) {
    model.procedure = std::to_string(presses_seen_) +
                      " presses of the device on a rigid object, constant by least squares against the "
                      "encoders (4.25); a lower bound, the object assumed no softer than " +
                      fixed_text(task_.least_object_stiffness_n_per_mm, 0) + " N/mm";
  } else {
    model.procedure = std::to_string(presses_seen_) + " presses on virtual walls, " +
                      (now.order == 2   ? "quadratic field"
                       : now.order == 1 ? "linear field"
                                        : "constant") +
                      " by least squares against an external position (4.26)";
  }
  for (const Press& press : presses_) {
    model.validity.max_force_n = std::max(model.validity.max_force_n, press.force_n);
  }
  return std::nullopt;
}

}  // namespace hapticd::identification
