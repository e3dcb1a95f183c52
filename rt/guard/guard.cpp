#include "rt/guard/guard.h"

#include <algorithm>
#include <cmath>

namespace hapticd::rt {

namespace {
/// False for NaN and infinity, and for numbers that are no measurement: one of 1e300 would poison a filter
/// for seconds.
bool sane(const hal::Vector3& v) noexcept {
  constexpr double kAbsurd = 1e4;  // 10 m, 10 kN, 10 N·m
  return std::abs(v.x) < kAbsurd && std::abs(v.y) < kAbsurd && std::abs(v.z) < kAbsurd;
}
}  // namespace

Guard::Guard(const GuardLimits& limits, double rate_hz) noexcept
    : limits_(limits), period_s_(1.0 / rate_hz) {}

void Guard::latch(GuardFault fault) noexcept {
  if (state_ == GuardState::kLatched) return;  // the first cause is the one to tell
  state_ = GuardState::kLatched;
  fault_ = fault;
  authority_ = 0.0;
}

GuardFault Guard::fault_of(const hal::RigSample& sample) const noexcept {
  using namespace hal::sample_status;
  if ((sample.status & kDeviceFault) != 0) return GuardFault::kDeviceFault;
  const hal::Quaternion& q = sample.tip_orientation;
  if (!sane(sample.tip_position_mm) || !std::isfinite(q.w + q.x + q.y + q.z)) return GuardFault::kNonFinite;
  if (limits_.sensor_stale_after_ms > 0.0) {  // the scene listens to a force sensor
    if (!sane(sample.sensor_force_n) || !sane(sample.sensor_torque_n_mm)) return GuardFault::kNonFinite;
    if ((sample.status & kForceFault) != 0) return GuardFault::kSensorFault;
    if ((sample.status & kForceSaturated) != 0) return GuardFault::kSensorSaturated;
    if (static_cast<double>(sample.force_age_ns) > 1e6 * limits_.sensor_stale_after_ms) {
      return GuardFault::kSensorStale;
    }
  }
  return GuardFault::kNone;
}

bool Guard::admit(const hal::RigSample& sample) noexcept {
  const GuardFault fault = fault_of(sample);
  last_sample_fit_ = fault == GuardFault::kNone;
  if (!last_sample_fit_) {
    latch(fault);
    has_position_ = false;
  }
  return last_sample_fit_;
}

bool Guard::clear() noexcept {
  if (!last_sample_fit_) return false;
  if (state_ == GuardState::kLatched) {
    state_ = GuardState::kResuming;
    fault_ = GuardFault::kNone;
    authority_ = 0.0;
  }
  return true;
}

hal::Vector3 Guard::bound(const hal::Vector3& wanted_n, const hal::RigSample& sample,
                          TickRecord& record) noexcept {
  std::uint8_t limited = 0;
  if (last_sample_fit_) {
    // Smoothed over about eight ticks: the bound on power needs no promptness, and one encoder step is not a
    // motion.
    const hal::Vector3 raw = (sample.tip_position_mm - last_position_mm_) * (1.0 / period_s_);
    velocity_mm_per_s_ =
        has_position_ ? velocity_mm_per_s_ + (raw - velocity_mm_per_s_) * 0.125 : hal::Vector3{};
    last_position_mm_ = sample.tip_position_mm;
    has_position_ = true;
  }
  if (state_ != GuardState::kLatched && !sane(wanted_n)) latch(GuardFault::kNonFinite);

  hal::Vector3 force;
  if (state_ != GuardState::kLatched) {
    if (state_ == GuardState::kResuming) {
      authority_ += limits_.resume_ramp_s > 0.0 ? period_s_ / limits_.resume_ramp_s : 1.0;
      if (authority_ >= 1.0) {
        authority_ = 1.0;
        state_ = GuardState::kRendering;
      }
    }
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
  record.guard_limits = limited;
  record.authority = authority_;
  return force;
}

}  // namespace hapticd::rt
