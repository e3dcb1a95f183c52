#include "rt/guard/guard.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <utility>

namespace hapticd::rt {

namespace {
/// Returns false for NaN and infinity, and for numbers that no sensor measures: one of 1e300 would poison a
/// filter for seconds.
bool sane(const hal::Vector3& v) noexcept {
  constexpr double kAbsurd = 1e4;                  // 10 m, 10 kN, 10 N·m
  if (dot(v, v) < kAbsurd * kAbsurd) return true;  // nearly always
  return std::abs(v.x) < kAbsurd && std::abs(v.y) < kAbsurd && std::abs(v.z) < kAbsurd;
}

constexpr FaultSet kTakesForce =
    faults_that([](const FaultRule& r) { return r.action != FaultAction::kWarn; });
constexpr FaultSet kCuts = faults_that([](const FaultRule& r) { return r.action == FaultAction::kCut; });
constexpr FaultSet kLatches =
    kTakesForce & faults_that([](const FaultRule& r) { return r.clearing != FaultClearing::kItself; });
constexpr FaultSet kRestarts = faults_that([](const FaultRule& r) { return r.restarts; });
constexpr FaultSet kUnfit = faults_that([](const FaultRule& r) { return r.unfit; });
constexpr FaultSet kOfSensor = faults_that([](const FaultRule& r) { return r.of_sensor; });
constexpr FaultSet kSaidBySensor =
    kTakesForce & faults_that([](const FaultRule& r) { return r.of_sensor && r.sample_status != 0; });

/// The faults that the drivers' status bits mean.
FaultSet faults_in(std::uint32_t sample_status) noexcept {
  FaultSet set = 0;
  for (const FaultRule& rule : kFaultTable) {
    if ((rule.sample_status & sample_status) != 0) set |= set_of(rule.fault);
  }
  return set;
}

/// Converts a limit in ms; one that is set stays one, and an absurd one fits.
std::int64_t in_ns(double ms) noexcept {
  constexpr double kMaxMs = 1e12;
  return ms > 0.0 ? std::max<std::int64_t>(1, static_cast<std::int64_t>(1e6 * std::min(ms, kMaxMs))) : 0;
}

/// Time from one instant to a later one; `instead_s` if time was at rest or went back.
double seconds_between(std::int64_t from_ns, std::int64_t to_ns, double instead_s) noexcept {
  return to_ns > from_ns ? 1e-9 * static_cast<double>(to_ns - from_ns) : instead_s;
}

double without_traces(double n) noexcept {
  return std::abs(n) < Guard::kTraceN ? 0.0 : n;
}

/// The one to show several: the most drastic, and of those the first in the table.
GuardFault foremost(FaultSet faults) noexcept {
  const FaultSet cutting = faults & kCuts;
  return static_cast<GuardFault>(std::countr_zero(cutting != 0 ? cutting : faults));
}
}  // namespace

Guard::Guard(const GuardLimits& limits, double rate_hz) noexcept
    : period_s_(1.0 / rate_hz), interval_s_(period_s_) {
  set_limits(limits);
}

void Guard::set_limits(const GuardLimits& limits) noexcept {
  limits_ = limits;
  stale_after_ns_ = in_ns(limits.sensor_stale_after_ms);
  gap_ns_ = in_ns(limits.loop_gap_ms);
  load_.set_parameters(limits.tool);
  if (!limits.renders_real_object) load_.forget_zero();
}

inline FaultSet Guard::faults_of(const hal::RigSample& sample, FaultSet noticed) noexcept {
  FaultSet faults = standing_ | noticed;
  if (sample.status != 0) {
    faults |= faults_in(sample.status);
    // A sensor that has said nothing since has not said that its fault is over.
    if ((sample.status & hal::sample_status::kForceMissing) != 0) faults |= present_ & kSaidBySensor;
  }
  const hal::Quaternion& q = sample.tip_orientation;
  if (!sane(sample.tip_position_mm) || !std::isfinite(q.w + q.x + q.y + q.z)) {
    faults |= set_of(GuardFault::kNonFinite);
  }
  if (has_time_ && gap_ns_ > 0 && sample.time_ns - last_time_ns_ > gap_ns_) {
    faults |= set_of(GuardFault::kLoopGap);
  }
  interval_s_ = has_time_ ? seconds_between(last_time_ns_, sample.time_ns, period_s_) : period_s_;
  last_time_ns_ = sample.time_ns;
  has_time_ = true;
  if (stale_after_ns_ > 0) {  // the scene listens to a force sensor
    if (!sane(sample.sensor_force_n) || !sane(sample.sensor_torque_n_mm)) {
      faults |= set_of(GuardFault::kNonFinite);
    }
    if (sample.force_age_ns > stale_after_ns_) {
      faults |= set_of(GuardFault::kSensorStale);
    }
    if (limits_.renders_real_object && reading_.update(sample, interval_s_, load_.unloaded_s() < kFreeAirS)) {
      faults |= set_of(GuardFault::kSensorFrozen);
    }
  } else {
    faults &= ~kOfSensor;
  }
  return faults;
}

bool Guard::follow(const hal::RigSample& sample, bool fit) noexcept {
  // Not the sample's clock: that of a recording that is played again goes back.
  followed_ns_ += static_cast<std::int64_t>(1e9 * std::min(interval_s_, 1.0));
  if (!fit) {
    speed_.reset();
    return false;
  }
  const std::int64_t position_ns = sample.time_ns - sample.position_age_ns;
  const hal::Vector3 step_mm =
      speed_.update(sample.tip_position_mm, seconds_between(last_position_ns_, position_ns, period_s_));
  last_position_ns_ = position_ns;
  return oscillation_.update(last_force_n_, step_mm, followed_ns_);
}

void Guard::apply_faults(FaultSet faults) noexcept {
  if ((faults & kRestarts) != 0) restart_ = true;
  const FaultSet taking = faults & kTakesForce;
  if (taking == 0) return;
  const FaultSet latching = taking & kLatches;
  if (latching != 0 && state_ != GuardState::kLatched) {  // the first cause is the one to report
    falls_ = holds_back() ? falls_ : true;
    state_ = GuardState::kLatched;
    fault_ = foremost(latching);
  } else if (!holds_back()) {
    falls_ = true;
    state_ = GuardState::kSuspended;
    fault_ = foremost(taking);
  }
  if ((taking & kCuts) != 0) {
    falls_ = false;
    authority_ = 0.0;
    oscillation_.reset();
  }
}

Admission Guard::admit(const hal::RigSample& sample, FaultSet noticed) noexcept {
  present_ = faults_of(sample, noticed);
  const bool fit = (present_ & kUnfit) == 0;
  if (limits_.renders_real_object) watch_load(sample, fit);
  if (follow(sample, fit)) present_ |= set_of(GuardFault::kOscillation);
  if ((present_ & kTakesForce) != 0) [[unlikely]] {
    apply_faults(present_);
  } else if (state_ == GuardState::kSuspended) {
    state_ = GuardState::kResuming;
    fault_ = GuardFault::kNone;
  }
  return {sample, fit, std::exchange(restart_, false)};
}

void Guard::raise(GuardFault fault) noexcept {
  raised_ |= set_of(fault);
  apply_faults(set_of(fault));
}

bool Guard::clear() noexcept {
  if ((present_ & kTakesForce) != 0) return false;
  if (state_ == GuardState::kLatched) {
    state_ = GuardState::kResuming;
    fault_ = GuardFault::kNone;
    authority_ = 0.0;
  }
  return true;
}

void Guard::update_authority() noexcept {
  const auto share = [](double interval_s, double ramp_s) {
    return ramp_s > 0.0 ? interval_s / ramp_s : 1.0;
  };
  if (holds_back()) {
    authority_ = falls_ ? std::max(0.0, authority_ - share(interval_s_, limits_.fall_ramp_s)) : 0.0;
  } else if (state_ == GuardState::kResuming) {
    authority_ = std::min(1.0, authority_ + share(rise_interval_s(), limits_.resume_ramp_s));
    if (authority_ == 1.0) state_ = GuardState::kRendering;
  }
}

void Guard::watch_load(const hal::RigSample& sample, bool fit) noexcept {
  if (!fit) return load_.interrupt();
  load_.update(sample, interval_s_, last_force_n_);
  const double risen = std::min(1.0, proven_share_ + interval_s_ / kProvenRiseS);
  proven_share_ = load_.is_waiting() || load_.is_left() ? 0.0 : risen;
  if (load_.has_jumped() || load_.is_unsure()) present_ |= set_of(GuardFault::kSensorJumped);
  const bool is_sure = is_load_sure();
  // A load that is not sure to be one does not end a fall that has begun.
  const double goes_on_s = is_sure || unloaded_s_ <= kFreeAirFromS ? 0.0 : unloaded_s_ + interval_s_;
  unloaded_s_ = std::max(load_.unloaded_s(), goes_on_s);
  double allowed_n = limits_.max_force_n;
  if (unloaded_s_ > kFreeAirFromS) {
    const double share = (kFreeAirS - unloaded_s_) / (kFreeAirS - kFreeAirFromS);
    allowed_n = std::max(kFreeAirN, loaded_n_ * share);
  }
  if (load_.is_suspected()) allowed_n = std::min(allowed_n, std::max(kFreeAirN, rendered_n_));
  double least_n = kFreeAirN;
  if (load_.is_unsure()) {
    least_n = 0.0;
    allowed_n = std::min(allowed_n, rendered_n_ / (1.0 + interval_s_ / kUnsureFallS));
  }
  const bool is_shown = load_.unloaded_s() < kShownS;
  const double rise_n = is_sure && is_shown ? kLoadRiseNPerS * rise_interval_s() : 0.0;
  allowed_n_ = std::min(allowed_n, std::max(allowed_n_, least_n) + rise_n);
}

bool Guard::is_load_sure() noexcept {
  if (load_.unloaded_s() > kGoneS) {
    gone_s_ = load_.unloaded_s();
    back_s_ = 0.0;
  } else {
    back_s_ = std::min(back_s_ + interval_s_, kBackS);
  }
  return back_s_ >= kBackS || (gone_s_ > kBackWithinS && back_s_ >= kSeenTwiceS);
}

double Guard::max_in_free_air_n() const noexcept {
  double max_n = std::numeric_limits<double>::infinity();
  if (!limits_.renders_real_object) return max_n;
  if (allowed_n_ < limits_.max_force_n) max_n = allowed_n_;
  if (proven_share_ < 1.0) max_n = std::min(max_n, limits_.max_force_n * proven_share_);
  return max_n;
}

hal::Vector3 Guard::within_bounds(hal::Vector3 force_n, double max_force_n,
                                  std::uint8_t& limited) const noexcept {
  double magnitude_n = std::sqrt(dot(force_n, force_n));
  if (magnitude_n == 0.0) return {};
  const hal::Vector3 direction = force_n * (1.0 / magnitude_n);
  if (magnitude_n > max_force_n) {
    magnitude_n = max_force_n;
    force_n = direction * magnitude_n;
    limited |= guard_limit::kForce;
  }
  const double bounded_from_mm_per_s = limits_.max_power_w / (1e-3 * magnitude_n);
  const double power_w = 1e-3 * magnitude_n * speed_.along_mm_per_s(direction, bounded_from_mm_per_s);
  if (power_w > limits_.max_power_w) {
    force_n = force_n * (limits_.max_power_w / power_w);
    limited |= guard_limit::kPower;
  }
  return force_n;
}

hal::Vector3 Guard::bounded(const hal::Vector3& wanted_n, const hal::Vector3& assistance_n,
                            double max_in_pose_n, std::uint8_t& limited) noexcept {
  const double max_modulated_n = max_in_free_air_n();
  const double modulated_n = std::sqrt(dot(wanted_n, wanted_n));
  if (modulated_n > max_modulated_n) {
    constexpr double kRounding = 1.0 - 1e-12;
    wanted_n_ = wanted_n * (kRounding * max_modulated_n / modulated_n) + assistance_n;
    limited |= guard_limit::kFreeAir;
  }
  if (!sane(wanted_n_)) [[unlikely]] {
    present_ |= set_of(GuardFault::kNonFinite);
    apply_faults(set_of(GuardFault::kNonFinite));
  }
  if (state_ != GuardState::kRendering) update_authority();

  hal::Vector3 force;
  if (authority_ > 0.0) {
    double max_force_n = limits_.max_force_n;
    // What the arm can give in this pose: rendered weaker instead of faulted by the device.
    const bool pose_decides = max_in_pose_n > 0.0 && max_in_pose_n < max_force_n;
    if (pose_decides) max_force_n = max_in_pose_n;
    // Not for the rate's sake either is there more in free air.
    if (max_modulated_n < max_force_n) {
      max_force_n = std::min(max_force_n, max_modulated_n + std::sqrt(dot(assistance_n, assistance_n)));
    }

    force = within_bounds(wanted_n_ * authority_, max_force_n, limited);
    const hal::Vector3 change = force - last_force_n_;
    const double max_change_n = limits_.max_force_rate_n_per_s * std::min(interval_s_, period_s_);
    if (const double squared = dot(change, change); squared > max_change_n * max_change_n) {
      // Between the last force, which may be above a bound that has come down since, and one that is not.
      force =
          within_bounds(last_force_n_ + change * (max_change_n / std::sqrt(squared)), max_force_n, limited);
      limited |= guard_limit::kRate;
    }
    if (pose_decides && (limited & guard_limit::kForce) != 0) limited |= guard_limit::kPose;
    force = {without_traces(force.x), without_traces(force.y), without_traces(force.z)};
  }
  const hal::Vector3 rendered = force - assistance_n;
  const double stands_n = std::sqrt(dot(rendered, rendered));
  rendered_n_ = std::min(stands_n, std::min(modulated_n, max_modulated_n));
  return force;
}

hal::Vector3 Guard::release(Admission admission, const hal::Vector3& wanted_n, std::uint8_t held_back,
                            const hal::Vector3& assistance_n) noexcept {
  std::uint8_t limited = 0;
  wanted_n_ = wanted_n + assistance_n;
  // Mostly so in free air: then there is nothing to bound.
  const bool is_nothing = dot(wanted_n, wanted_n) == 0.0 && dot(last_force_n_, last_force_n_) == 0.0 &&
                          dot(assistance_n, assistance_n) == 0.0;
  if (is_nothing) {
    rendered_n_ = 0.0;
    if (state_ != GuardState::kRendering) update_authority();
  } else {
    last_force_n_ = bounded(wanted_n, assistance_n, admission.sample_.max_force_n, limited);
  }
  if (unloaded_s_ <= kFreeAirFromS) loaded_n_ = rendered_n_;

  reported_ = present_ | std::exchange(raised_, 0);
  limited_ = static_cast<std::uint8_t>(held_back | limited);
  return last_force_n_;
}

void Guard::fill_record(TickRecord& record) const noexcept {
  record.channels |= channel::kGuard;
  record.device_command_n = last_force_n_;
  record.guard_state = state_;
  record.guard_fault = fault_;
  record.faults_present = reported_;
  record.guard_limits = limited_;
  record.authority = authority_;
}

}  // namespace hapticd::rt
