#include "hal/sim/tracker/simulated_tracker.h"

#include <cmath>
#include <numbers>
#include <utility>

#include "hal/sim/base/rotation.h"

namespace hapticd::sim {

namespace {

constexpr double kRadPerDeg = std::numbers::pi / 180.0;
constexpr double kHiddenS = 0.25;
constexpr double kOutlierMm = 40.0;

Vector3 normal_vector(Random& random, double deviation) noexcept {
  const double x = deviation * random.normal();
  const double y = deviation * random.normal();
  return {x, y, deviation * random.normal()};
}

Vector3 turned(const hal::Quaternion& q, const Vector3& v) noexcept {
  return to_tool(inverse(q), v);
}

}  // namespace

SimulatedTracker::SimulatedTracker(const Conditions& conditions, std::uint64_t seed) noexcept
    : c_(conditions), random_(seed ^ 0x747261636b6572ULL) {
  truth_.tracker_from_rig = rotation(normal_vector(random_, 1.2));
  truth_.tracker_from_rig_mm = normal_vector(random_, 600.0);
  truth_.tool_from_marker = rotation(normal_vector(random_, 0.6));
  // Above the tip, somewhat to a side.
  const double angle = 2.0 * std::numbers::pi * random_.uniform();
  truth_.marker_mm = {0.5 * c_.tracker_marker_mm * std::cos(angle),
                      0.5 * c_.tracker_marker_mm * std::sin(angle), std::sqrt(0.75) * c_.tracker_marker_mm};
}

void SimulatedTracker::observe(std::int64_t time_ns, const Vector3& tip_mm,
                               const hal::Quaternion& orientation) noexcept {
  if (!there()) return;
  const double now_s = 1e-9 * static_cast<double>(time_ns);
  if (seen_before_) {
    while (next_s_ <= now_s) {
      const double share = now_s > before_s_ ? (next_s_ - before_s_) / (now_s - before_s_) : 1.0;
      const hal::Quaternion& a = before_;
      const hal::Quaternion& b = orientation;
      const double sign = a.w * b.w + a.x * b.x + a.y * b.y + a.z * b.z < 0.0 ? -1.0 : 1.0;
      const auto mix = [&](double from, double to) { return from + share * (sign * to - from); };
      hal::Quaternion between{mix(a.w, b.w), mix(a.x, b.x), mix(a.y, b.y), mix(a.z, b.z)};
      const double norm = std::sqrt(between.w * between.w + between.x * between.x + between.y * between.y +
                                    between.z * between.z);
      between = {between.w / norm, between.x / norm, between.y / norm, between.z / norm};
      send(next_s_, before_mm_ + (tip_mm - before_mm_) * share, between);
      next_s_ += 1.0 / c_.tracker_rate_hz;
    }
  } else {
    next_s_ = now_s;
  }
  seen_before_ = true;
  before_s_ = now_s;
  before_mm_ = tip_mm;
  before_ = orientation;
}

void SimulatedTracker::send(double time_s, const Vector3& tip_mm,
                            const hal::Quaternion& orientation) noexcept {
  TrackerPose pose;
  const Vector3 in_rig = tip_mm + turned(orientation, truth_.marker_mm);
  pose.position_mm = turned(truth_.tracker_from_rig, in_rig) + truth_.tracker_from_rig_mm +
                     normal_vector(random_, c_.tracker_noise_mm);
  pose.orientation = composed(truth_.tracker_from_rig, composed(orientation, truth_.tool_from_marker));
  pose.orientation =
      composed(pose.orientation, rotation(normal_vector(random_, c_.tracker_noise_deg * kRadPerDeg)));
  pose.has_orientation = c_.tracker_positions_only < 0.5;
  double stamp_s = time_s + 1e-3 * c_.tracker_latency_ms + 1e-3 * c_.tracker_jitter_ms * random_.normal();
  stamp_s += c_.tracker_clock_offset_s + 1e-6 * c_.tracker_clock_drift_ppm * stamp_s;
  if (c_.tracker_clock_jump_ms != 0.0 && time_s >= c_.tracker_clock_jump_at_s) {
    stamp_s += 1e-3 * c_.tracker_clock_jump_ms;
  }
  if (random_.uniform() < c_.tracker_outlier_share) {
    pose.position_mm = pose.position_mm + normal_vector(random_, kOutlierMm);
    pose.orientation = composed(pose.orientation, rotation(normal_vector(random_, 0.5)));
  }
  // As many begin as make up the share.
  if (time_s >= hidden_until_s_ &&
      random_.uniform() < c_.tracker_dropout_share / (kHiddenS * c_.tracker_rate_hz)) {
    hidden_until_s_ = time_s + kHiddenS;
  }
  if (time_s < hidden_until_s_) return;

  if (c_.tracker_axes_swapped > 0.5) std::swap(pose.position_mm.x, pose.position_mm.y);
  if (c_.tracker_mirrored > 0.5) {
    // As a program in a left-handed frame has it: x reversed, and turns about y and z with it.
    pose.position_mm.x = -pose.position_mm.x;
    pose.orientation.y = -pose.orientation.y;
    pose.orientation.z = -pose.orientation.z;
  }
  pose.position_mm = pose.position_mm * c_.tracker_unit_scale;
  if (c_.tracker_frozen_at_s > 0.0 && time_s >= c_.tracker_frozen_at_s) {
    if (!frozen_) frozen_ = pose;
    pose = *frozen_;
  }
  pose.stamp_ns = std::llround(1e9 * stamp_s);
  const std::size_t at = pushed_.load(std::memory_order_relaxed);
  if (at - popped_.load(std::memory_order_acquire) == kCapacity) return;
  sent_[at % kCapacity] = pose;
  pushed_.store(at + 1, std::memory_order_release);
}

bool SimulatedTracker::take(TrackerPose& pose) noexcept {
  const std::size_t at = popped_.load(std::memory_order_relaxed);
  if (at == pushed_.load(std::memory_order_acquire)) return false;
  pose = sent_[at % kCapacity];
  popped_.store(at + 1, std::memory_order_release);
  return true;
}

}  // namespace hapticd::sim
