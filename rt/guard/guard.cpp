#include "rt/guard/guard.h"

#include <algorithm>
#include <bit>
#include <cmath>

namespace hapticd::rt {

namespace {
/// False for NaN and infinity, and for numbers that are no measurement: one of 1e300 would poison a filter
/// for seconds.
bool sane(const hal::Vector3& v) noexcept {
  constexpr double kAbsurd = 1e4;  // 10 m, 10 kN, 10 N·m
  return std::abs(v.x) < kAbsurd && std::abs(v.y) < kAbsurd && std::abs(v.z) < kAbsurd;
}

constexpr FaultSet kTakesForce =
    faults_that([](const FaultRule& r) { return r.action != FaultAction::kWarn; });
constexpr FaultSet kCuts = faults_that([](const FaultRule& r) { return r.action == FaultAction::kCut; });
constexpr FaultSet kLatches =
    kTakesForce & faults_that([](const FaultRule& r) { return r.clearing != FaultClearing::kItself; });
constexpr FaultSet kUnfit = faults_that([](const FaultRule& r) { return r.unfit; });
constexpr FaultSet kOfSensor = faults_that([](const FaultRule& r) { return r.of_sensor; });

/// The faults that the drivers' status bits mean.
FaultSet faults_in(std::uint32_t sample_status) noexcept {
  FaultSet set = 0;
  for (const FaultRule& rule : kFaultTable) {
    if ((rule.sample_status & sample_status) != 0) set |= set_of(rule.fault);
  }
  return set;
}

/// Of a limit in ms; one that is set stays one, and an absurd one fits.
std::int64_t in_ns(double ms) noexcept {
  constexpr double kLongestMs = 1e12;
  return ms > 0.0 ? std::max<std::int64_t>(1, static_cast<std::int64_t>(1e6 * std::min(ms, kLongestMs))) : 0;
}

/// The one to tell of several: the most drastic, and of those the first in the table.
GuardFault foremost(FaultSet faults) noexcept {
  const FaultSet cutting = faults & kCuts;
  return static_cast<GuardFault>(std::countr_zero(cutting != 0 ? cutting : faults));
}
}  // namespace

Guard::Guard(const GuardLimits& limits, double rate_hz) noexcept
    : period_s_(1.0 / rate_hz) {
  set_limits(limits);
}

void Guard::set_limits(const GuardLimits& limits) noexcept {
  limits_ = limits;
  stale_after_ns_ = in_ns(limits.sensor_stale_after_ms);
  gap_ns_ = in_ns(limits.loop_gap_ms);
}

inline FaultSet Guard::faults_of(const hal::RigSample& sample) noexcept {
  FaultSet faults = standing_;
  if (sample.status != 0) faults |= faults_in(sample.status);
  const hal::Quaternion& q = sample.tip_orientation;
  if (!sane(sample.tip_position_mm) || !std::isfinite(q.w + q.x + q.y + q.z)) {
    faults |= set_of(GuardFault::kNonFinite);
  }
  if (stale_after_ns_ > 0) {  // the scene listens to a force sensor
    if (!sane(sample.sensor_force_n) || !sane(sample.sensor_torque_n_mm)) {
      faults |= set_of(GuardFault::kNonFinite);
    }
    if (sample.force_age_ns > stale_after_ns_) {
      faults |= set_of(GuardFault::kSensorStale);
    }
  } else {
    faults &= ~kOfSensor;
  }
  if (has_time_ && gap_ns_ > 0 && sample.time_ns - last_time_ns_ > gap_ns_) {
    faults |= set_of(GuardFault::kLoopGap);
  }
  last_time_ns_ = sample.time_ns;
  has_time_ = true;
  return faults;
}

void Guard::heed(FaultSet faults) noexcept {
  const FaultSet taking = faults & kTakesForce;
  if (taking == 0) return;
  const FaultSet latching = taking & kLatches;
  if (latching != 0 && state_ != GuardState::kLatched) {  // the first cause is the one to tell
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
  }
}

bool Guard::admit(const hal::RigSample& sample) noexcept {
  present_ = faults_of(sample);
  if ((present_ & kTakesForce) != 0) [[unlikely]] {
    heed(present_);
  } else if (state_ == GuardState::kSuspended) {
    state_ = GuardState::kResuming;
    fault_ = GuardFault::kNone;
  }
  const bool fit = (present_ & kUnfit) == 0;
  if (!fit) has_position_ = false;
  return fit;
}

void Guard::raise(GuardFault fault) noexcept {
  raised_ |= set_of(fault);
  heed(set_of(fault));
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
  const auto step = [this](double ramp_s) { return ramp_s > 0.0 ? period_s_ / ramp_s : 1.0; };
  if (holds_back()) {
    authority_ = falls_ ? std::max(0.0, authority_ - step(limits_.fall_ramp_s)) : 0.0;
  } else if (state_ == GuardState::kResuming) {
    authority_ = std::min(1.0, authority_ + step(limits_.resume_ramp_s));
    if (authority_ == 1.0) state_ = GuardState::kRendering;
  }
}

hal::Vector3 Guard::bound(const hal::Vector3& wanted_n, const hal::RigSample& sample,
                          TickRecord& record) noexcept {
  std::uint8_t limited = 0;
  if ((present_ & kUnfit) == 0) {
    // Smoothed over about eight ticks: the bound on power needs no promptness, and one encoder step is not a
    // motion.
    const hal::Vector3 raw = (sample.tip_position_mm - last_position_mm_) * (1.0 / period_s_);
    velocity_mm_per_s_ =
        has_position_ ? velocity_mm_per_s_ + (raw - velocity_mm_per_s_) * 0.125 : hal::Vector3{};
    last_position_mm_ = sample.tip_position_mm;
    has_position_ = true;
  }
  if (!sane(wanted_n)) [[unlikely]] {
    present_ |= set_of(GuardFault::kNonFinite);
    heed(set_of(GuardFault::kNonFinite));
  }
  if (state_ != GuardState::kRendering) update_authority();

  hal::Vector3 force;
  if (authority_ > 0.0) {
    force = wanted_n * authority_;
    const double max_force_n = limits_.max_force_n;
    if (const double squared = dot(force, force); squared > max_force_n * max_force_n) {
      force = force * (max_force_n / std::sqrt(squared));
      limited |= guard_limit::kForce;
    }
    const double power_w = 1e-3 * dot(force, velocity_mm_per_s_);
    if (power_w > limits_.max_power_w) {
      force = force * (limits_.max_power_w / power_w);
      limited |= guard_limit::kPower;
    }
    const hal::Vector3 change = force - last_force_n_;
    const double largest_change_n = limits_.max_force_rate_n_per_s * period_s_;
    if (const double squared = dot(change, change); squared > largest_change_n * largest_change_n) {
      force = last_force_n_ + change * (largest_change_n / std::sqrt(squared));
      limited |= guard_limit::kRate;
    }
  }
  last_force_n_ = force;

  record.channels |= channel::kGuard;
  record.device_command_n = force;
  record.guard_state = state_;
  record.guard_fault = fault_;
  record.faults_present = present_ | raised_;
  raised_ = 0;
  record.guard_limits |= limited;
  record.authority = authority_;
  return force;
}

}  // namespace hapticd::rt
