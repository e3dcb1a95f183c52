#include "client/cli/demo/press_trace.h"

#include <algorithm>
#include <cmath>

#include "client/cli/plot/press_axis.h"

namespace hapticd::cli {
namespace {

constexpr double kReleaseTime_s = 0.3;  // a bounce of the tip does not count as a release
constexpr double kSmoothing_s = 0.05;
constexpr double kFullForcePart = 0.9;
constexpr double kMinHoldS = 0.2;
constexpr double kDriftPart = 0.03;

/// Force that is held: the median of all that is more than half of the largest, so that neither an overshoot
/// nor the time of pressing and releasing moves it.
double held_force(const std::vector<PressPoint>& points) {
  double largest = 0.0;
  for (const auto& point : points) largest = std::max(largest, point.hand_force_n);
  std::vector<double> upper;
  for (const auto& point : points) {
    if (point.hand_force_n > 0.5 * largest) upper.push_back(point.hand_force_n);
  }
  if (upper.empty()) return 0.0;
  const auto middle = upper.begin() + static_cast<std::ptrdiff_t>(upper.size() / 2);
  std::nth_element(upper.begin(), middle, upper.end());
  return *middle;
}

/// Means over the points of a stretch of time.
SettledHold mean_between(const std::vector<PressPoint>& points, double from_s, double to_s) {
  SettledHold mean{.duration_s = to_s - from_s};
  std::size_t count = 0;
  for (const auto& point : points) {
    if (point.time_s < from_s || point.time_s > to_s) continue;
    mean.hand_force_n += point.hand_force_n;
    mean.displacement_mm += point.displacement_mm;
    ++count;
  }
  if (count == 0) return mean;
  mean.hand_force_n /= static_cast<double>(count);
  mean.displacement_mm /= static_cast<double>(count);
  return mean;
}

}  // namespace

void PressTrace::add(const v1::TelemetrySample& sample) {
  if (!sample.has_truth()) return;
  const double time_s = static_cast<double>(sample.time_ns()) * 1e-9;
  const auto& truth = sample.truth();
  points_.push_back({time_s, truth.displacement_mm(), into_object(truth.hand_force_n()), truth.in_contact()});
  if (truth.in_contact()) {
    touched_ = true;
    released_since_s_ = -1.0;
  } else if (touched_ && released_since_s_ < 0.0) {
    released_since_s_ = time_s;
  }
}

bool PressTrace::over() const noexcept {
  return touched_ && released_since_s_ >= 0.0 && points_.back().time_s - released_since_s_ > kReleaseTime_s;
}

std::optional<ReleasePoint> release_point(const std::vector<PressPoint>& points) {
  std::size_t deepest = 0;
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (points[i].in_contact && points[i].displacement_mm > points[deepest].displacement_mm) deepest = i;
  }
  if (points.empty() || !points[deepest].in_contact) return std::nullopt;
  for (std::size_t i = deepest; i + 1 < points.size(); ++i) {
    if (points[i + 1].in_contact) continue;
    return ReleasePoint{i, points[i].displacement_mm, points[i].hand_force_n};
  }
  return std::nullopt;
}

std::optional<SettledHold> settled_hold(const std::vector<PressPoint>& points) {
  const double full = kFullForcePart * held_force(points);
  if (full <= 0.0) return std::nullopt;
  // Running mean over the last kSmoothing_s; the first and the last moment at which it is at full force.
  double sum = 0.0;
  std::size_t oldest = 0;
  std::optional<double> begin_s;
  double end_s = 0.0;
  for (std::size_t i = 0; i < points.size(); ++i) {
    sum += points[i].hand_force_n;
    while (points[i].time_s - points[oldest].time_s > kSmoothing_s) sum -= points[oldest++].hand_force_n;
    if (sum / static_cast<double>(i - oldest + 1) < full) continue;
    if (!begin_s) begin_s = points[i].time_s;
    end_s = points[i].time_s - kSmoothing_s;
  }
  if (!begin_s || end_s - *begin_s < kMinHoldS) return std::nullopt;

  // The last tenth is left out: the release may already have begun.
  const double from_s = *begin_s + 0.5 * (end_s - *begin_s);
  const double to_s = *begin_s + 0.9 * (end_s - *begin_s);
  const double middle_s = 0.5 * (from_s + to_s);
  const SettledHold first = mean_between(points, from_s, middle_s);
  const SettledHold second = mean_between(points, middle_s, to_s);
  const bool drifts = std::abs(second.hand_force_n - first.hand_force_n) > kDriftPart * full;
  const SettledHold hold = mean_between(points, from_s, to_s);
  if (drifts || hold.displacement_mm <= 0.0) return std::nullopt;
  return hold;
}

}  // namespace hapticd::cli
