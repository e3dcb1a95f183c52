#include "server/identification/session/gains_identification.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "rt/control/force_controller.h"
#include "rt/signal/vector.h"
#include "rt/target/desired_force.h"
#include "server/identification/session/fixed_text.h"

namespace hapticd::identification {

namespace {

constexpr double kPressedN = 0.4;  // of the sensor: the hand is on the object
constexpr double kFreeN = 0.2;
constexpr double kFreeForS = 0.25;
constexpr double kSilentS = 0.1;    // no force at all under a pressing hand, after there was some
constexpr double kNotReadyS = 0.5;  // and if there was none yet
constexpr double kQuietN = 0.05;
// Amplitude below which an oscillation is taken for the hand's own tremor or the encoder's step.
constexpr double kMinMm = 0.05;
constexpr double kViolentMm = 2.0;  // no waiting for more cycles of that size while they grow
constexpr double kMinChangeN = 0.25;
constexpr double kViolentN = 3.0;

}  // namespace

GainsIdentification::GainsIdentification(const GainsTask& task, const hal::RigInfo& rig)
    : IdentificationSession(gains_kind()),
      task_(task),
      rig_(rig),
      gate_(gains_policy()),
      oscillation_(rig.rate_hz > 0.0 ? rig.rate_hz : 1000.0,
                   std::max(kMinMm, 1.5 * rig.device.position_resolution_mm), kViolentMm),
      in_force_(rig.rate_hz > 0.0 ? rig.rate_hz : 1000.0, kMinChangeN, kViolentN) {
  trials_.reserve(kMaxTrials);
  if (!rig.renders_force || rig.kind == hal::RigKind::kReplay) refuse("nothing renders force on a recording");
  if (!(task.target_stiffness_n_per_mm > 0.0 && task.target_stiffness_n_per_mm < 100.0)) {
    refuse("the target stiffness must be between 0 and 100 N/mm");
  }
  const double structural = rig.device.structural_stiffness_n_per_mm;
  if (structural > 0.0 && task.target_stiffness_n_per_mm > rt::kMaxCompensableRatio * structural) {
    refuse("the target stiffness is more than " + fixed_text(rt::kMaxCompensableRatio, 1) +
           " of the device's own structural stiffness, " + fixed_text(structural, 2) +
           " N/mm: no scene renders it");
  }
}

void GainsIdentification::refuse(const std::string& why) {
  phase_ = Phase::kRefused;
  refusal_ = why;
  backing_off_ = false;
}

double GainsIdentification::bounded_derivative_ms(double gain, double wanted_ms) const noexcept {
  // |Kd'| < 1 and Kp + 2 Kd' < 2, in samples.
  const double period_ms = 1e3 / rig_.rate_hz;
  const double admitted_ms = period_ms * std::min(1.0, 0.5 * (kControllerLimit - gain));
  return std::clamp(wanted_ms, 0.0, kDerivativeShare * std::max(0.0, admitted_ms));
}

/// Ends a range: it oscillates at `end`, or the controller's own limit is there.
void GainsIdentification::close_range(double end, double period_s) {
  if (range_from_ > 0.0 && end / range_from_ > ultimate_ / std::max(1e-9, lowest_holding_)) {
    lowest_holding_ = range_from_;
    ultimate_ = end;
    period_s_ = period_s;
    limit_first_ = end >= kControllerLimit;
  }
  range_from_ = 0.0;
}

/// Goes on to the next gain, or to the end of the search.
void GainsIdentification::go_on() {
  phase_ = Phase::kSearch;
  const bool oscillates = range_from_ == 0.0;
  if (gain_ < kLastGain && !(oscillates && gain_ >= 1.0 && lowest_holding_ > 0.0)) {
    return propose(gain_ * kStep, 0.0);
  }
  if (gain_ >= kLastGain) close_range(kControllerLimit, 0.0);
  if (lowest_holding_ == 0.0) {
    return refuse("no gain below the controller's own limit holds " +
                  fixed_text(task_.target_stiffness_n_per_mm, 2) +
                  " N/mm on this object: ask for another target");
  }
  choose();
}

/// Proposes the next gains to try; all that is ever requested passes here.
void GainsIdentification::propose(double gain, double derivative_ms) {
  gain = std::min(gain, kLastGain);
  if (!rt::gains_are_stable({rt::ControlLaw::kClosedLoop, gain, derivative_ms}, rig_.rate_hz))
    derivative_ms = 0.0;
  gain_ = gain;
  derivative_ms_ = derivative_ms;
}

void GainsIdentification::choose() {
  double gain = kUltimateShare * (limit_first_ ? kControllerLimit : ultimate_);
  if (gain < lowest_holding_) {
    // The range that holds does not reach down to 0.6 K_c: its middle keeps the same distance to both ends.
    gain = std::sqrt(lowest_holding_ * (limit_first_ ? kLastGain : ultimate_));
    remark_ = "0.6 K_c lies below the lowest gain that holds, " + fixed_text(lowest_holding_, 2) +
              ": the middle of the range was taken";
  }
  const double wanted_ms = limit_first_ ? 0.0 : 1e3 * kPeriodShare * gain * period_s_;
  phase_ = Phase::kVerify;
  propose(gain, bounded_derivative_ms(gain, wanted_ms));
}

void GainsIdentification::end_trial(bool oscillates) {
  lost_presses_ = 0;
  const UltimateOscillation& reported = oscillation_.period_s() > 0.0 ? oscillation_ : in_force_;
  Trial trial{gain_, derivative_ms_, oscillates, reported.period_s(), oscillation_.amplitude()};
  if (trials_.size() == kMaxTrials) trials_.erase(trials_.begin());
  trials_.push_back(trial);
  pressed_ = false;
  acted_ = false;
  backing_off_ = oscillates;
  free_s_ = 0.0;
  switch (phase_) {
    case Phase::kSearch:
      if (oscillates && range_from_ > 0.0) {
        phase_ = Phase::kConfirm;  // the same gain again: one knock of the hand does not make a limit
        return;
      }
      if (!oscillates) {
        if (range_from_ == 0.0) range_from_ = gain_;
        highest_holding_ = gain_;
      }
      return go_on();
    case Phase::kConfirm:
      if (oscillates) {
        close_range(gain_, trial.period_s);
      } else {
        highest_holding_ = gain_;
      }
      return go_on();
    case Phase::kVerify:
      if (!oscillates) {
        verified_ = true;
        phase_ = Phase::kDone;
      } else if (derivative_ms_ > 0.0) {
        remark_ = "with Kd = " + fixed_text(derivative_ms_, 3) + " ms it oscillated: without";
        propose(gain_, 0.0);
      } else {
        remark_ = "the gains chosen oscillated when they were tried";
        phase_ = Phase::kDone;
      }
      return;
    case Phase::kDone:
    case Phase::kRefused:
      return;
  }
}

void GainsIdentification::add(const rt::Observation& observation) {
  const hal::RigSample& sample = observation.sample;
  const double now_s = 1e-9 * static_cast<double>(sample.time_ns);
  if (gate_.judged() == 0) first_s_ = now_s;
  last_s_ = now_s;
  if (phase_ == Phase::kDone || phase_ == Phase::kRefused) return;
  const SampleGate::Verdict verdict = gate_.judge(observation);
  if (verdict == SampleGate::Verdict::kSkip) {
    using namespace hal::sample_status;
    if ((sample.status & (kForceFault | kDeviceFault | kForceSaturated)) != 0 && acted_) {
      refuse("device or sensor reported a fault while the gain was raised");
    }
    return;
  }
  const double step_s = gate_.step_s();
  if (verdict == SampleGate::Verdict::kRestart) {
    // Whatever happened meanwhile: this press is judged no further, and is asked for again.
    pressed_ = acted_ = false;
    free_s_ = 0.0;
    return;
  }

  // What the hand bears: the object's share of a press may be small next to the device's.
  const hal::Vector3 load_n =
      rt::rotated(rt::unit(sample.tip_orientation), sample.sensor_force_n) + observation.device_command_n;
  const double force_n = rt::norm(load_n);
  const double command_n = rt::norm(observation.device_command_n);
  const bool free = force_n < kFreeN;
  free_s_ = free ? free_s_ + step_s : 0.0;
  if (backing_off_) {
    if (free_s_ > kFreeForS && command_n < kQuietN) backing_off_ = false;
    return;
  }
  if (press_is_lost_) {
    press_is_lost_ = free_s_ <= kFreeForS;
    return;
  }
  if (!pressed_) {
    if (force_n < kPressedN) return;
    pressed_ = true;
    acted_ = false;
    pressed_s_ = 0.0;
    silent_s_ = 0.0;
    axis_ = rt::direction_or(load_n, {0.0, 0.0, 1.0});
    oscillation_.reset();
    in_force_.reset();
  }
  ++used_;
  pressed_s_ += step_s;
  acted_ = acted_ || command_n > 0.0;
  silent_s_ = command_n == 0.0 && force_n > kPressedN ? silent_s_ + step_s : 0.0;
  if (silent_s_ > (acted_ ? kSilentS : kNotReadyS)) {
    // A contact that a late tick ended renders again once the tool was lifted.
    if (++lost_presses_ < kMaxLostPresses) {
      press_is_lost_ = true;
      pressed_ = false;
      return;
    }
    return refuse(acted_ ? "the device fell silent under a pressing hand at Kp = " + fixed_text(gain_, 2) +
                               ", press after press: see whether the guard has latched before going on"
                         : "the device gives no force: no scene renders, or its guard is latched");
  }
  if (command_n > kRunAwayN) {
    if (std::max(oscillation_.swings(), in_force_.swings()) >= 2) return end_trial(true);
    return refuse("the device's force ran away to " + fixed_text(command_n, 1) + " N under a press of " +
                  fixed_text(kPressN, 0) + " N: this object does not admit " +
                  fixed_text(task_.target_stiffness_n_per_mm, 2) + " N/mm");
  }
  if (pressed_s_ < kImpactSettlingS) return;
  oscillation_.update(dot(sample.tip_position_mm, axis_));
  in_force_.update(dot(observation.device_command_n, axis_));
  for (const UltimateOscillation* o : {&oscillation_, &in_force_}) {
    if (o->violent() || o->sustained()) return end_trial(true);
  }
  if (free_s_ > kFreeForS) {
    if (pressed_s_ - free_s_ > kWatchS) {
      end_trial(false);
    } else {
      pressed_ = false;  // too short to judge; asked for again
    }
  }
}

MotionRequest GainsIdentification::next_request() const {
  MotionRequest request;
  if (phase_ == Phase::kDone || phase_ == Phase::kRefused) {
    request.words = phase_ == Phase::kRefused ? refusal_ : "";
    return request;
  }
  if (backing_off_) {
    request.hold_s = 0.5;
    request.words = trials_.empty() ? "let go: the search begins with the tool free and at rest"
                                    : "let go: it oscillates at Kp = " + fixed_text(trials_.back().gain, 2);
    return request;
  }
  request.motion = MotionRequest::Motion::kPress;
  request.device = MotionRequest::Device::kModulation;
  request.stiffness_n_per_mm = task_.target_stiffness_n_per_mm;
  request.proportional_gain = gain_;
  request.derivative_ms = derivative_ms_;
  request.force_n = kPressN;
  request.force_rate_n_per_s = 8.0;
  request.hold_s = kWatchS;
  request.words = press_is_lost_ ? "let go: the device was silent; then " : "";
  request.words += "press the object to " + fixed_text(kPressN, 0) +
                   " N, hold for a second and let go (Kp = " + fixed_text(gain_, 2) + ")";
  return request;
}

void GainsIdentification::find(IdentificationProgress& progress) const {
  progress.samples = used_;
  progress.duration_s = last_s_ - first_s_;
  Coverage coverage({"proportional gain", "1", 0.0, kControllerLimit, 10}, {"presses", "1", 0.0, 1.0, 1});
  for (const Trial& trial : trials_) {
    progress.fit.push_back({trial.gain, trial.oscillates ? trial.amplitude_mm : 0.0, 0.0});
    ++coverage.counts[coverage.cell_at(trial.gain)];
  }
  const bool done = phase_ == Phase::kDone;
  const double highest = done || phase_ == Phase::kVerify ? ultimate_ : gain_;
  // The gains that a search tries on its way there: its steps become wider than a cell.
  for (double gain = kFirstGain; gain <= highest; gain = std::min(gain * kStep, kLastGain)) {
    coverage.required[coverage.cell_at(gain)] = 1;
    if (gain >= kLastGain) break;
  }
  coverage.update_share(0.0);
  progress.coverage.push_back(coverage);

  constexpr double kUnknown = std::numeric_limits<double>::infinity();
  if (ultimate_ > 0.0) {
    // The search goes in steps: the limit is anywhere within the last step.
    const double step_error = limit_first_ ? kUnknown : ultimate_ * (kStep - 1.0) / std::sqrt(12.0);
    progress.parameters.push_back({"ultimate_gain", "1", ultimate_, step_error});
    progress.parameters.push_back(
        {"ultimate_period_ms", "ms", 1e3 * period_s_, limit_first_ ? kUnknown : 1e3 / rig_.rate_hz});
    progress.parameters.push_back(
        {"proportional_gain", "1", gain_, limit_first_ ? 0.0 : kUltimateShare * step_error});
    progress.parameters.push_back({"derivative_gain_ms", "ms", derivative_ms_, 0.0});
    progress.parameters.push_back(
        {"lowest_holding_gain", "1", lowest_holding_,
         lowest_holding_ > kFirstGain ? lowest_holding_ * (kStep - 1.0) / std::sqrt(12.0) : kUnknown});
  } else if (highest_holding_ > 0.0) {
    progress.parameters.push_back({"highest_holding_gain", "1", highest_holding_, kUnknown});
  }
  progress.steady = progress.certain = ultimate_ > 0.0;
  progress.converged = done && verified_;
  const double along = std::log(gain_ / kFirstGain) / std::log(kLastGain / kFirstGain);
  progress.completion = done ? 1.0 : phase_ == Phase::kVerify ? 0.9 : 0.85 * along;
  if (!done) progress.missing.push_back(next_request().words);
  if (done && !verified_)
    progress.missing.emplace_back("a softer target: the gains chosen do not hold this one");
  if (limit_first_) {
    progress.remarks.emplace_back(
        "the controller's own limit, Kp = 2, comes before any oscillation: the ultimate gain is a lower "
        "bound, found by presses that stayed steady, and there is no period");
  }
  if (!remark_.empty()) progress.remarks.push_back(remark_);
  for (std::string& remark : gate_.remarks()) progress.remarks.push_back(std::move(remark));
}

std::optional<hal::Error> GainsIdentification::conclude(const IdentificationProgress& /*now*/,
                                                        rt::IdentifiedModel& model) const {
  if (phase_ == Phase::kRefused) {
    return refusal("the search was given up", refusal_, "", "see to it, then start again");
  }
  if (ultimate_ == 0.0) {
    return refusal(
        "the ultimate gain was not reached",
        highest_holding_ > 0.0 ? "Kp up to " + fixed_text(highest_holding_, 2) + " holds" : "no press judged",
        "presses of " + fixed_text(kWatchS, 1) + " s at rising gain", next_request().words);
  }
  rt::GainsModel gains;
  gains.proportional_gain = gain_;
  gains.derivative_ms = derivative_ms_;
  gains.ultimate_gain = ultimate_;
  gains.ultimate_period_ms = 1e3 * period_s_;
  model.content = gains;
  model.procedure = std::to_string(trials_.size()) + " presses at rising gain, target " +
                    fixed_text(task_.target_stiffness_n_per_mm, 2) +
                    " N/mm: Kp = " + fixed_text(kUltimateShare, 1) +
                    " K_c, Kd = Kp T_c/8 within the stable region (Ziegler and Nichols, D§3.3.2)" +
                    (limit_first_ ? "; the controller's own limit came first" : "");
  model.validity.max_force_n = kPressN;
  return std::nullopt;
}

}  // namespace hapticd::identification
