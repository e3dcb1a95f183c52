#include "server/scene/scene_cost.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <numbers>
#include <vector>

#include "rt/scene/renderer.h"

namespace hapticd::server {

namespace {

using Clock = std::chrono::steady_clock;
using hal::Vector3;

constexpr std::chrono::milliseconds kBudget{20};
constexpr std::uint32_t kTicks = 5000;
constexpr std::uint32_t kApproachTicks = 500;
constexpr std::uint32_t kPressTicks = 700;
constexpr std::uint32_t kStrokeTicks = 3000;
constexpr double kApproachMm = 5.0;
constexpr double kStiffnessNPerMm = 0.6;
constexpr double kMaxDepthMm = 5.0;
constexpr double kStrokeMm = 20.0;
constexpr double kStrokeFriction = 0.3;
constexpr double kGravityMmPerS2 = 9807.0;

/// Share from 0 to 1, smoothly, for `count` ticks from `begin` on.
double eased(std::uint32_t tick, std::uint32_t begin, std::uint32_t count) {
  if (tick <= begin) return 0.0;
  if (tick >= begin + count) return 1.0;
  return 0.5 - 0.5 * std::cos(std::numbers::pi * static_cast<double>(tick - begin) / count);
}

double length(const Vector3& v) {
  return std::sqrt(dot(v, v));
}

/// A unit vector across another.
Vector3 across(const Vector3& unit) {
  const Vector3 other = std::abs(unit.x) < 0.8 ? Vector3{1.0, 0.0, 0.0} : Vector3{0.0, 1.0, 0.0};
  const Vector3 rest = other - unit * dot(unit, other);
  return rest * (1.0 / length(rest));
}

/// Samples of an approach, a press, a stroke and a release, without a device.
class SyntheticTouch {
 public:
  SyntheticTouch(const rt::SceneSpec& spec, const hal::RigInfo& rig)
      : rate_hz_(rig.rate_hz),
        into_(spec.press_axis),
        along_(across(spec.press_axis)),
        surface_mm_(spec.kind == rt::SceneKind::kWall ? spec.wall_position_mm : 0.0),
        stiffness_n_per_mm_(std::max(kStiffnessNPerMm, 2.0 * spec.contact.threshold_n / kMaxDepthMm)) {
    // The tool stays upright; what it weighs counts only if the sensor was biased in another orientation.
    if (spec.kind == rt::SceneKind::kExplore) {
      bias_n_ = (Vector3{0.0, 0.0, -1.0} - spec.explore.gravity_at_bias) *
                (1e-6 * spec.tool_mass_g * kGravityMmPerS2);
    }
  }

  hal::RigSample at(std::uint32_t tick) {
    const double depth_mm = depth_at(tick);
    const double along_mm = kStrokeMm * eased(tick, kApproachTicks + kPressTicks, kStrokeTicks);
    const double speed_mm_per_s = (along_mm - last_along_mm_) * rate_hz_;
    last_along_mm_ = along_mm;
    const double normal_n = stiffness_n_per_mm_ * std::max(0.0, depth_mm);
    const double friction_n = kStrokeFriction * normal_n * speed_mm_per_s / (std::abs(speed_mm_per_s) + 1.0);
    hal::RigSample sample;
    sample.tick = tick;
    sample.time_ns = static_cast<std::int64_t>(1e9 * tick / rate_hz_);
    sample.tip_position_mm = into_ * (surface_mm_ + depth_mm) + along_ * along_mm;
    sample.sensor_force_n = into_ * -normal_n + along_ * -friction_n + bias_n_;
    sample.force_count = 1;
    return sample;
  }

 private:
  static double depth_at(std::uint32_t tick) {
    constexpr std::uint32_t kReleased = kApproachTicks + kPressTicks + kStrokeTicks;
    const double path_mm = kApproachMm + kMaxDepthMm;
    return path_mm * (eased(tick, kApproachTicks / 2, kApproachTicks / 2 + kPressTicks) -
                      eased(tick, kReleased, kTicks - kReleased)) -
           kApproachMm;
  }

  double rate_hz_;
  Vector3 into_;
  Vector3 along_;
  double surface_mm_;
  double stiffness_n_per_mm_;
  Vector3 bias_n_;
  double last_along_mm_ = 0.0;
};

std::int64_t since(Clock::time_point begin) {
  return std::chrono::duration_cast<std::chrono::nanoseconds>(Clock::now() - begin).count();
}

double quantile(std::vector<std::int64_t>& values, double share) {
  if (values.empty()) return 0.0;
  const auto rank = static_cast<std::ptrdiff_t>(share * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), values.begin() + rank, values.end());
  return static_cast<double>(values[static_cast<std::size_t>(rank)]);
}

/// The time that two readings of the clock take.
double clock_cost_ns() {
  std::vector<std::int64_t> costs;
  for (int i = 0; i < 101; ++i) costs.push_back(since(Clock::now()));
  return quantile(costs, 0.5);
}

}  // namespace

SceneCost measure_cost(rt::Pipeline& pipeline, const rt::SceneSpec& resolved, const hal::RigInfo& rig) {
  const Clock::time_point until = Clock::now() + kBudget;
  std::vector<std::int64_t> costs;
  costs.reserve(kTicks);
  std::uint32_t in_contact = 0;
  // The first round warms the caches and is not counted, unless it takes the whole time.
  for (int round = 0; round < 2 && Clock::now() < until; ++round) {
    costs.clear();
    in_contact = 0;
    rt::Renderer renderer(resolved.guard, rig.rate_hz);
    renderer.exchange(&pipeline, resolved.guard);
    SyntheticTouch touch(resolved, rig);
    for (std::uint32_t tick = 0; tick < kTicks; ++tick) {
      const hal::RigSample sample = touch.at(tick);
      const Clock::time_point begin = Clock::now();
      if (begin >= until) break;
      rt::TickRecord record;
      renderer.tick(sample, record);
      costs.push_back(since(begin));
      if (record.in_contact) ++in_contact;
    }
  }
  const double clock_ns = clock_cost_ns();
  SceneCost cost;
  cost.ticks = static_cast<std::uint32_t>(costs.size());
  cost.median_ns = std::max(0.0, quantile(costs, 0.5) - clock_ns);
  cost.p999_ns = std::max(0.0, quantile(costs, 0.999) - clock_ns);
  cost.remark = fmt::format(
      "measured on this machine outside the loop, with synthetic samples: {} ticks in contact, {} out of it",
      in_contact, cost.ticks - in_contact);
  return cost;
}

}  // namespace hapticd::server
