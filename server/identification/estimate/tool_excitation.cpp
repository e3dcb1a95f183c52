#include "server/identification/estimate/tool_excitation.h"

#include <algorithm>
#include <cmath>

#include "rt/signal/tool_compensation.h"
#include "rt/signal/tool_load.h"
#include "rt/signal/vector.h"
#include "server/identification/gate/sample_policy.h"

namespace hapticd::identification {

namespace {

constexpr double kReachS = 0.016;  // of a rotation's differences: gimbals are noisy

hal::Quaternion inverse(const hal::Quaternion& q) noexcept {
  return {q.w, -q.x, -q.y, -q.z};
}
/// Rotation vector [rad] of a unit quaternion; q and -q are the same rotation.
hal::Vector3 rotation_vector(const hal::Quaternion& q) noexcept {
  const double sign = q.w < 0.0 ? -1.0 : 1.0;
  const hal::Vector3 axis{sign * q.x, sign * q.y, sign * q.z};
  const double sine = rt::norm(axis);
  const double angle = 2.0 * std::atan2(sine, sign * q.w);
  return axis * (sine > 1e-9 ? angle / sine : 2.0);
}

}  // namespace

ToolExcitationFilter::ToolExcitationFilter(double rate_hz, bool force_is_mean)
    : rate_hz_(rate_hz > 0.0 ? rate_hz : 1000.0),
      force_is_mean_(force_is_mean),
      cutoff_hz_(std::min(kCutoffHz, rate_hz_ / 8.0)),
      reach_(static_cast<std::size_t>(std::clamp(std::round(kReachS * rate_hz_), 1.0, 500.0))),
      window_(2 * reach_ + 1) {
  for (std::size_t i = 0; i < kChannels; ++i) {
    first_.emplace_back(cutoff_hz_, rate_hz_);
    second_.emplace_back(cutoff_hz_, rate_hz_);
  }
}

std::optional<ToolExcitation> ToolExcitationFilter::update(const hal::RigSample& sample) {
  const std::size_t length = window_.size();
  window_[next_] = sample;
  next_ = (next_ + 1) % length;
  count_ = std::min(count_ + 1, length);
  if (count_ < length) {
    settled_ = 0;
    return std::nullopt;
  }

  const auto at = [&](std::size_t i) -> const hal::RigSample& { return window_[(next_ + i) % length]; };
  const hal::RigSample& middle = at(reach_);
  // Acceleration over the whole window: ticks that make up for a late one follow it within microseconds, and
  // a step of the encoders over such a time does not count as acceleration.
  const hal::RigSample& before = at(0);
  const hal::RigSample& last = at(length - 1);
  const hal::RigSample& after = at(reach_ + 1);
  const double step_before_s = 1e-9 * static_cast<double>(middle.time_ns - before.time_ns);
  const double step_after_s = 1e-9 * static_cast<double>(last.time_ns - middle.time_ns);
  const hal::Vector3 acceleration =
      ((last.tip_position_mm - middle.tip_position_mm) * (1.0 / step_after_s) -
       (middle.tip_position_mm - before.tip_position_mm) * (1.0 / step_before_s)) *
      (2.0 / (step_before_s + step_after_s));

  const hal::Quaternion here = rt::unit(middle.tip_orientation);
  const hal::Quaternion back = inverse(here);
  const double span_s = 0.5e-9 * static_cast<double>(at(length - 1).time_ns - at(0).time_ns);
  const hal::Vector3 onward = rotation_vector(rt::product(back, rt::unit(at(length - 1).tip_orientation)));
  const hal::Vector3 from = rotation_vector(rt::product(back, rt::unit(at(0).tip_orientation)));
  const hal::Vector3 rate = (onward - from) * (0.5 / span_s);
  const hal::Vector3 turning = (onward + from) * (1.0 / (span_s * span_s));

  ToolExcitation e;
  e.gravity_in_tool = rt::rotated(back, {0.0, 0.0, -1.0});
  const double per_g = rt::inertial_force_n(1.0, 1.0);
  std::array<hal::Vector3, kChannels> channels;
  channels[0] = (e.gravity_in_tool * rt::ToolLoad::kGravityMmPerS2 - rt::rotated(back, acceleration)) * per_g;
  const double square = dot(rate, rate);
  channels[1] =
      hal::Vector3{rate.x * rate.x - square, rate.x * rate.y - turning.z, rate.x * rate.z + turning.y} *
      per_g;
  channels[2] =
      hal::Vector3{rate.x * rate.y + turning.z, rate.y * rate.y - square, rate.y * rate.z - turning.x} *
      per_g;
  channels[3] =
      hal::Vector3{rate.x * rate.z - turning.y, rate.y * rate.z + turning.x, rate.z * rate.z - square} *
      per_g;
  // A mean over the tick before the middle and one over the tick after it are centred on it together.
  channels[4] = force_is_mean_ ? (middle.sensor_force_n + after.sensor_force_n) * 0.5 : middle.sensor_force_n;
  channels[5] = force_is_mean_ ? (middle.sensor_torque_n_mm + after.sensor_torque_n_mm) * 0.5
                               : middle.sensor_torque_n_mm;

  const bool fresh = settled_ == 0;
  for (std::size_t i = 0; i < kChannels; ++i) {
    if (fresh) {
      first_[i].seed(channels[i]);
      second_[i].seed(channels[i]);
    }
    channels[i] = second_[i].update(first_[i].update(channels[i]));
  }
  ++settled_;
  if (static_cast<double>(settled_) < kToolSettlingS * rate_hz_) return std::nullopt;
  e.weight_n_per_g = channels[0];
  e.turning_n_per_g_mm = {channels[1], channels[2], channels[3]};
  e.force_n = channels[4];
  e.torque_n_mm = channels[5];
  // Off the diagonal, half the difference of B and its transpose is α.
  const hal::Vector3 alpha = hal::Vector3{channels[3].y - channels[2].z, channels[1].z - channels[3].x,
                                          channels[2].x - channels[1].y} *
                             (0.5 / per_g);
  e.turning_rad_per_s2 = rt::norm(alpha);
  return e;
}

}  // namespace hapticd::identification
