#include "server/identification/session/structural_identification.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "rt/signal/vector.h"
#include "server/identification/session/fixed_text.h"

namespace hapticd::rt {

namespace {

constexpr double kLoadedN = 0.05;      // less is no press: friction and DAC steps are of this size
constexpr double kFirmN = 0.5;         // a press whose peak is less says nothing
constexpr double kMovingMmPerS = 3.0;  // below, the sign of friction is anybody's guess
constexpr double kQuasiStaticNPerS = 80.0;
constexpr double kWindowS = 0.016;  // of a velocity; recordings may have slower ticks
constexpr double kFreeAfterS = 0.15;
// Rigid contact. Below, the two surfaces still settle; the encoders move by the bend alone, and slower than
// this they may stick while the force changes.
constexpr double kSettledN = 0.3;
constexpr double kBendingMmPerS = 1.0;
// Soft enough that the device presses with 2 … 3 times the hand's force, stiff enough to stay steady.
constexpr double kRigidTarget = 1.0;   // N/mm
constexpr double kRigidHandN = 2.0;    // the device adds k_s / kRigidTarget times as much
constexpr double kRigidDeviceN = 5.0;  // of the device; a press counts from half of this on
// Soft enough that a press runs through 10 mm and more: an instrument's calibration error averages out on the
// way.
constexpr double kStiffWall = 0.45;  // N/mm
constexpr double kSoftWall = 0.3;
constexpr double kEnoughComplianceError = 0.006;  // of the compliance at the centre, relative
constexpr double kEnoughFieldError = 0.01;
constexpr double kEnoughRigidError = 0.01;  // what the object hides is of that size anyway
// On hardware: a winding cools in some twelve seconds, and a press that begins at this heat stays below what
// a device warns at, 0.8.
constexpr double kCoolingTimeS = 12.0;
constexpr double kWarmedHeat = 0.3;
constexpr double kCooledHeat = 0.25;
constexpr double kRestS = 1.0;
constexpr double kPressOverContinuous = 3.0;  // force of a press on a wall, against what is borne for ever
constexpr double kRigidOverContinuous = 2.5;
constexpr std::size_t kMaxRounds = 8;

double component(const hal::Vector3& v, std::size_t i) noexcept {
  return i == 0 ? v.x : i == 1 ? v.y : v.z;
}
/// 4 … 16: beyond 1 kHz a window of 17 ticks does.
std::size_t ticks_in(double duration_s, double rate_hz) noexcept {
  return static_cast<std::size_t>(std::clamp(std::round(duration_s * rate_hz), 4.0, 16.0));
}

}  // namespace

StructuralIdentification::StructuralIdentification(const StructuralStiffnessTask& task,
                                                   const hal::RigInfo& rig)
    : task_(task),
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

void StructuralIdentification::add(const Observation& observation) {
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
                rigid ? norm(sample.sensor_force_n) : 0.0};
  greatest_force_n_ = std::max(greatest_force_n_, norm(raw.force_n));
  const SampleGate::Verdict verdict = gate_.follow(observation);
  if (verdict == SampleGate::Verdict::kSkip) return;
  if (verdict == SampleGate::Verdict::kRestart) {
    window_count_ = 0;
  } else if (window_count_ > 0) {
    const Raw& last = window_[(window_next_ + window_ticks_ - 1) % window_ticks_];
    if ((!rigid || norm(raw.force_n) > kSettledN) &&
        norm((raw.outside_mm - raw.encoder_mm) - (last.outside_mm - last.encoder_mm)) > 1.0) {
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

void StructuralIdentification::warm_up(const Observation& observation) noexcept {
  const double continuous_n = rig_.device.max_continuous_force_n;
  if (rig_.kind != hal::RigKind::kHardware || !(continuous_n > 0.0)) return;
  const std::int64_t now_ns = observation.sample.time_ns;
  const double step_s = 1e-9 * static_cast<double>(now_ns - heated_at_ns_);
  heated_at_ns_ = now_ns;
  if (!(step_s > 0.0 && step_s < 1.0)) return;
  // An arm that gives less in its pose warms more for the same force.
  const double pose_n = observation.sample.max_force_n;
  const double weaker =
      pose_n > 0.0 && rig_.device.max_force_n > pose_n ? rig_.device.max_force_n / pose_n : 1.0;
  const double ratio = norm(observation.device_command_n) / continuous_n * weaker;
  heat_ += (ratio * ratio - heat_) * std::min(1.0, step_s / kCoolingTimeS);
  cooling_ = heat_ > (cooling_ ? kCooledHeat : kWarmedHeat);
}

void StructuralIdentification::take(const Row& row) {
  const bool loaded = norm(row.force_n) > (task_.rigid_contact ? kSettledN : kLoadedN);
  if (!pressing_) {
    if (!loaded) {
      if (task_.rigid_contact) return;  // off the object the tip goes anywhere
      before_[before_next_] = row;
      before_next_ = (before_next_ + 1) % kBefore;
      before_count_ = std::min(before_count_ + 1, kBefore);
      return;
    }
    pressing_ = true;
    press_ = Press{};
    free_rows_ = 0;
    for (std::size_t i = 0; i < before_count_; ++i) {
      accumulate(press_, before_[i]);
      press_.points_zero_mm =
          press_.points_zero_mm + before_[i].deflection_mm * (1.0 / static_cast<double>(before_count_));
    }
    if (task_.rigid_contact) {
      press_.points_zero_mm = row.deflection_mm;
      press_.points_zero_n = norm(row.force_n);
    }
    before_count_ = 0;
    before_next_ = 0;
  }
  if (loaded || !task_.rigid_contact) accumulate(press_, row);
  const double force_n = norm(row.force_n);
  if (force_n > press_.force_n) {
    press_.force_n = force_n;
    press_.reaction_n = row.reaction_n;
    press_.place_mm = row.place_mm;
    press_.axis = 2;
    for (int i = 0; i < 2; ++i) {
      if (std::abs(component(row.force_n, static_cast<std::size_t>(i))) >
          std::abs(component(row.force_n, static_cast<std::size_t>(press_.axis)))) {
        press_.axis = i;
      }
    }
  }
  if (loaded && --rows_until_point_ <= 0 && press_.point_count < press_.points.size()) {
    const double along_mm = dot(row.deflection_mm - press_.points_zero_mm, row.force_n) / force_n;
    press_.points[press_.point_count++] = {force_n, along_mm, 0.0};
    rows_until_point_ = static_cast<int>(0.1 * rig_.rate_hz);
  }
  free_rows_ = loaded ? 0 : free_rows_ + 1;
  if (free_rows_ >= free_rows_after_) close_press();
}

void StructuralIdentification::accumulate(Press& press, const Row& row) const noexcept {
  for (std::size_t i = 0; i < 3; ++i) {
    const double speed = component(row.velocity_mm_per_s, i);
    const double force = component(row.force_n, i);
    const double rate = component(row.force_rate_n_per_s, i);
    const double deflection = component(row.deflection_mm, i);
    if (std::abs(rate) > kQuasiStaticNPerS) continue;
    if (std::abs(speed) < (task_.rigid_contact ? kBendingMmPerS : kMovingMmPerS)) continue;
    if (std::abs(deflection) > 1e4) continue;  // sums of absurd numbers would drown the rest
    press.axes[i].add({row.place_mm, force, speed, rate, deflection});
  }
}

void StructuralIdentification::close_press() {
  pressing_ = false;
  const StructuralSums& sums = press_.axes[static_cast<std::size_t>(press_.axis)];
  if (press_.force_n < kFirmN || sums.rows < 20.0) return;
  rows_used_ += static_cast<std::uint64_t>(sums.rows);
  if (presses_.size() < kMaxPresses) {
    presses_.push_back(press_);
  } else {
    presses_[presses_seen_ % kMaxPresses] = press_;
  }
  ++presses_seen_;
  const StructuralFit now = fit(0);
  if (now.good) {
    if (history_.size() >= 64) history_.erase(history_.begin());
    history_.push_back(now.model.stiffness_n_per_mm);
  }
  if (task_.rigid_contact) rigid_enough_ = progress().converged;
}

bool StructuralIdentification::visited(std::size_t target) const noexcept {
  constexpr double kNearMm = 45.0;  // a press ends well below where it began
  return std::any_of(presses_.begin(), presses_.end(), [&](const Press& press) {
    return norm(press.place_mm - targets_mm_[target]) < kNearMm && press.force_n > 0.5 * press_force_n_;
  });
}

StructuralFit StructuralIdentification::fit(int highest_order) const {
  std::vector<const StructuralPress*> presses;
  for (const Press& press : presses_) presses.push_back(&press);
  return fit_structural(presses, highest_order, rig_.rate_hz);
}

StructuralIdentification::RigidBounds StructuralIdentification::bounds_of(
    const StructuralModel& model) const noexcept {
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

std::vector<EstimatedParameter> StructuralIdentification::parameters_of(const StructuralFit& fit) const {
  std::vector<EstimatedParameter> parameters = fit.parameters;
  if (!task_.rigid_contact) return parameters;
  const RigidBounds bounds = bounds_of(fit.model);
  EstimatedParameter& stiffness = parameters.front();
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

MotionRequest StructuralIdentification::press_at(std::size_t target, const char* why) const {
  MotionRequest request;
  request.motion = MotionRequest::Motion::kPress;
  request.device = MotionRequest::Device::kWall;
  request.stiffness_n_per_mm =
      (target + presses_seen_ / targets_mm_.size()) % 2 == 0 ? kStiffWall : kSoftWall;
  request.force_n = press_force_n_;
  request.force_rate_n_per_s = 12.0;
  request.hold_s = 0.05;
  request.place_mm = targets_mm_[target];
  // Heights are staggered: an instrument whose calibration is off periodically, watched at a few heights
  // only, would pass that off as a field. Multiples of the golden section, modulo one, fill an interval
  // evenly.
  const double golden = 0.6180339887 * static_cast<double>(presses_seen_);
  request.place_mm.z += kStaggerMm * (golden - std::floor(golden) - 0.5);
  request.words = why + fixed_text(request.place_mm.x, 0) + " mm aside, " +
                  fixed_text(request.place_mm.y, 0) + " mm across and " + fixed_text(request.place_mm.z, 0) +
                  " mm above the home, to " + fixed_text(press_force_n_, 1) + " N, and let go";
  return request;
}

MotionRequest StructuralIdentification::press_rigid() const {
  MotionRequest request;
  request.motion = MotionRequest::Motion::kPress;
  request.device = MotionRequest::Device::kModulation;
  request.stiffness_n_per_mm = kRigidTarget;
  // The object does not give way; the encoders do, by f_d/k_s. Compensated, any force would be too little.
  request.encoders_as_they_are = true;
  request.max_device_force_n = 1.5 * press_force_n_;
  if (rig_.device.max_force_n > 0.0) {
    request.max_device_force_n = std::min(request.max_device_force_n, rig_.device.max_force_n);
  }
  request.force_n = kRigidHandN;
  request.force_rate_n_per_s = 4.0;
  request.hold_s = 0.05;
  request.words = "press the rigid object to " + fixed_text(kRigidHandN, 0) +
                  " N in half a second, straight down, and let go: the device presses on with more";
  return request;
}

std::size_t StructuralIdentification::wanted_presses() const noexcept {
  return task_.rigid_contact ? kRigidPresses : targets_mm_.size();
}

std::size_t StructuralIdentification::pressed_enough() const noexcept {
  std::size_t done = 0;
  if (task_.rigid_contact) {
    for (const Press& press : presses_) done += press.force_n > 0.5 * press_force_n_ ? 1U : 0U;
    return std::min(done, kRigidPresses);
  }
  for (std::size_t i = 0; i < targets_mm_.size(); ++i) done += visited(i) ? 1U : 0U;
  return done;
}

MotionRequest StructuralIdentification::next_request() const {
  // In the middle of a press nothing is taken away.
  if (must_cool() && !pressing_) {
    MotionRequest rest;
    rest.hold_s = kRestS;
    rest.words = "let go for some seconds: the motors of the device have to cool";
    return rest;
  }
  if (task_.rigid_contact) {
    return !rigid_enough_ && presses_seen_ < kMaxRounds * kRigidPresses ? press_rigid() : MotionRequest{};
  }
  if (outside_missing_ > 0 && outside_missing_ == gate_.judged()) {
    MotionRequest request;
    request.words = "let an instrument from outside say where the tip is: the encoders cannot see the bend";
    return request;
  }
  for (std::size_t i = 0; i < targets_mm_.size(); ++i) {
    if (!visited(i)) return press_at(i, "press the wall ");
  }
  if (!progress().converged && presses_seen_ < kMaxRounds * targets_mm_.size()) {
    return press_at(presses_seen_ % targets_mm_.size(), "press the wall once more ");
  }
  return {};
}

IdentificationProgress StructuralIdentification::progress() const {
  IdentificationProgress progress;
  progress.samples = rows_used_;
  progress.duration_s = gate_.watched_s();
  progress.residual = std::numeric_limits<double>::quiet_NaN();
  const StructuralFit now = fit(task_.constant ? 0 : 2);
  const std::size_t done = pressed_enough();
  const std::size_t wanted = wanted_presses();
  const bool rigid = task_.rigid_contact;

  Coverage sideways{{"x", "mm", -kAsideMm * 1.5, kAsideMm * 1.5, 3},
                    {"y", "mm", -kAcrossMm * 1.5, kAcrossMm * 1.5, 3},
                    std::vector<std::uint32_t>(9),
                    std::vector<std::uint8_t>(9),
                    0.0};
  Coverage upward{{"z", "mm", kMiddleMm - 1.5 * kUpDownMm, kMiddleMm + 1.5 * kUpDownMm, 3},
                  {"force", "N", 0.0, press_force_n_, 2},
                  std::vector<std::uint32_t>(6),
                  std::vector<std::uint8_t>(6),
                  0.0};
  const auto bin = [](const Coverage::Axis& axis, double value) {
    const double share = (value - axis.from) / (axis.to - axis.from);
    return static_cast<std::size_t>(std::clamp(std::floor(share * axis.bins), 0.0, axis.bins - 1.0));
  };
  for (const hal::Vector3& target : targets_mm_) {
    sideways.required[bin(sideways.y, target.y) * 3 + bin(sideways.x, target.x)] = 1;
    upward.required[3 + bin(upward.x, target.z)] = 1;
  }
  for (const Press& press : presses_) {
    ++sideways.counts[bin(sideways.y, press.place_mm.y) * 3 + bin(sideways.x, press.place_mm.x)];
    ++upward.counts[bin(upward.y, press.force_n) * 3 + bin(upward.x, press.place_mm.z)];
  }
  for (Coverage* coverage : {&sideways, &upward}) {
    if (rigid) break;  // it is where it is: no places to visit
    coverage->update_share();
    progress.coverage.push_back(*coverage);
  }

  progress.fit_x = "device force [N]";
  progress.fit_y = "deflection [mm]";
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
  const bool covered = done == wanted;
  progress.converged = covered && progress.certain && progress.steady;
  const double share = static_cast<double>(done) / static_cast<double>(wanted);
  completion_ = std::max(completion_, progress.converged ? 1.0 : 0.95 * share);
  progress.completion = completion_;

  if (outside_missing_ > 0 && outside_missing_ == gate_.judged()) {
    progress.missing.push_back("an instrument from outside that says where the tip is (D§4.6.1: an LVDT)");
  }
  if (!covered) {
    progress.missing.push_back(
        std::to_string(wanted - done) + " of " + std::to_string(wanted) +
        (rigid ? " presses with more than " + fixed_text(0.5 * press_force_n_, 1) + " N of the device: "
               : " places: ") +
        next_request().words);
  } else if (!progress.certain) {
    progress.missing.push_back("more presses: the stiffness is known to " +
                               fixed_text(100.0 * (task_.constant ? now.centre_error : now.worst_error), 2) +
                               " %, wanted " +
                               fixed_text(100.0 * (rigid            ? kEnoughRigidError
                                                   : task_.constant ? kEnoughComplianceError
                                                                    : kEnoughFieldError),
                                          1) +
                               " %");
  } else if (!progress.steady) {
    progress.missing.push_back("more presses: the last ones still changed the stiffness by more than 1 %");
  }
  if (progress.converged) progress.missing.clear();

  progress.remarks = gate_.remarks();
  const auto remark = [&](std::uint64_t count, const char* what) {
    if (count > 0) progress.remarks.push_back(std::to_string(count) + " " + what);
  };
  remark(jumps_, rigid ? "jumps of the encoders by more than 1 mm under force"
                       : "jumps of more than 1 mm between the instruments");
  if (outside_missing_ < gate_.judged())
    remark(outside_missing_, "samples without the instrument from outside");
  remark(now.left_out, "presses left out that fit four times worse than the others");
  if (now.good && now.order < (task_.constant ? 0 : 2)) {
    progress.remarks.push_back(std::string("too few places for a field: ") +
                               (now.order == 0 ? "constant" : "linear") + " so far");
  }
  if (now.good && rigid) {
    const RigidBounds bounds = bounds_of(now.model);
    progress.remarks.push_back(
        "a lower bound: what the object gives way counts as the device's; on one of " +
        fixed_text(task_.least_object_stiffness_n_per_mm, 0) + " N/mm, as assumed, it is " +
        (std::isfinite(bounds.upper_n_per_mm) ? fixed_text(bounds.upper_n_per_mm, 3) + " N/mm"
                                              : "all the object"));
    if (now.spread > 0.03) {
      progress.remarks.push_back("presses differ by " + fixed_text(100.0 * now.spread, 1) +
                                 " %: is the object fastened, and does the tip stay on one spot?");
    }
  } else if (now.good && task_.constant && presses_.size() >= 3 && now.spread > 0.03) {
    progress.remarks.push_back(
        "the stiffness differs by " + fixed_text(100.0 * now.spread, 1) +
        " % from place to place: a constant one is wrong by that much, ask for a field");
  }
  return progress;
}

hal::Result<IdentifiedModel> StructuralIdentification::finish() const {
  const char* where = "structural stiffness identification";
  const bool rigid = task_.rigid_contact;
  if (gate_.judged() == 0) {
    return hal::Error{"no data", where, "0 samples", "",
                      rigid ? "press a rigid object" : "press virtual walls"};
  }
  if (pressing_) {  // the data end in a press: it counts as far as possible
    StructuralIdentification closed(*this);
    closed.close_press();
    return closed.finish();
  }
  if (outside_missing_ == gate_.judged()) {
    return hal::Error{"no external instrument measures the tip's position", where, "",
                      "an external displacement reading next to the encoders (4.26)",
                      "the encoders cannot see the device bend: mount one, e.g. an LVDT of 30 µm"};
  }
  const StructuralFit now = fit(task_.constant ? 0 : 2);
  if (!now.good) {
    const std::string seen = std::to_string(presses_.size()) +
                             " presses beyond 0.5 N; the greatest force is " +
                             fixed_text(greatest_force_n_, 3) + " N";
    const std::string check = rigid ? "check the signs and units of force and position"
                                    : "check the signs and units of force and external position";
    return hal::Error{
        "no press determines the stiffness", where, seen,
        rigid ? "presses of the device, changing by up to 80 N/s, under which the encoders follow "
                "the force by more than 1 mm/s"
              : "presses on virtual walls, moving by more than 3 mm/s and changing by up to 80 "
                "N/s, with a deflection that grows against the force",
        presses_.empty() ? next_request().words + "; with a recording, " + check : check};
  }
  if (now.residual > 0.9) {
    return hal::Error{"the deflection does not follow the force", where,
                      "residual " + fixed_text(100.0 * now.residual, 0) + " % of what was measured",
                      "below 90 %",
                      rigid ? "check that the tip stays on the object, and the signs and units of force and "
                              "position"
                            : "check that the instrument watches the tip and has the encoders' frame and "
                              "units"};
  }
  if (rigid && !std::isfinite(bounds_of(now.model).upper_n_per_mm)) {
    return hal::Error{"the object may give way as much as the device", where,
                      "found " + fixed_text(now.model.stiffness_n_per_mm, 2) + " N/mm, with an object of " +
                          fixed_text(task_.least_object_stiffness_n_per_mm, 0) + " N/mm or more",
                      "an object much stiffer than the device",
                      "press on a block of wood or steel, and say how stiff it is at least "
                      "(least_object_stiffness_n_per_mm)"};
  }
  IdentifiedModel model;
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
  model.parameters = parameters_of(now);
  for (const Press& press : presses_) {
    model.validity.max_force_n = std::max(model.validity.max_force_n, press.force_n);
  }
  model.residual = now.residual;
  model.converged = progress().converged;
  if (auto error = check(model)) return *error;
  return model;
}

}  // namespace hapticd::rt
