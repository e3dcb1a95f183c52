#include "server/calibration/estimate/stream_offset.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <utility>

namespace hapticd::calibration {

namespace {

constexpr double kCoarseStepS = 0.02;
constexpr double kStepS = 0.005;
constexpr double kSpanS = 0.1;  ///< over which a speed is taken: noise of 0.3 mm is 4 mm/s then
constexpr std::size_t kMinSpeeds = 30;
constexpr std::size_t kFewestSpeeds = 200;  ///< that tell one offset from another in a long recording
constexpr double kSpanWithAllSpeedsS = 60.0;
constexpr double kMaxSearchS = 3600.0;  ///< some seconds of computing

struct Speed {
  double stamp_s;
  double value;
};

std::vector<Speed> marker_speeds(const std::vector<ReferencePose>& poses) {
  std::vector<Speed> speeds;
  std::size_t first = 0;
  for (std::size_t i = 0; i < poses.size(); ++i) {
    while (poses[i].stamp_s - poses[first].stamp_s > kSpanS) ++first;
    const double span_s = poses[i].stamp_s - poses[first].stamp_s;
    if (first == i || span_s < 0.5 * kSpanS) continue;
    speeds.push_back({0.5 * (poses[i].stamp_s + poses[first].stamp_s),
                      (poses[i].position_mm - poses[first].position_mm).norm() / span_s});
  }
  if (speeds.empty()) return speeds;
  // An outlier is a jump there and back: its speed is cut to what is usual.
  std::vector<double> sorted;
  for (const Speed& s : speeds) sorted.push_back(s.value);
  const auto at = sorted.begin() + static_cast<std::ptrdiff_t>(0.9 * static_cast<double>(sorted.size()));
  std::nth_element(sorted.begin(), at, sorted.end());
  for (Speed& s : speeds) s.value = std::min(s.value, 1.5 * *at);
  return speeds;
}

std::optional<double> correlation(const RigStream& rig, const std::vector<Speed>& speeds, std::size_t stride,
                                  double offset_s) {
  double n = 0.0;
  double a = 0.0;
  double b = 0.0;
  double aa = 0.0;
  double bb = 0.0;
  double ab = 0.0;
  for (std::size_t i = 0; i < speeds.size(); i += stride) {
    const auto from = rig.at(speeds[i].stamp_s - offset_s - 0.5 * kSpanS);
    const auto to = rig.at(speeds[i].stamp_s - offset_s + 0.5 * kSpanS);
    if (!from || !to) continue;
    const double x = (to->tip_mm - from->tip_mm).norm() / kSpanS;
    const double y = speeds[i].value;
    n += 1.0;
    a += x;
    b += y;
    aa += x * x;
    bb += y * y;
    ab += x * y;
  }
  if (n < static_cast<double>(kMinSpeeds) ||
      n * static_cast<double>(stride) < 0.5 * static_cast<double>(speeds.size())) {
    return std::nullopt;
  }
  const double va = aa / n - a * a / (n * n);
  const double vb = bb / n - b * b / (n * n);
  if (!(va > 0.0) || !(vb > 0.0)) return std::nullopt;
  return (ab / n - a * b / (n * n)) / std::sqrt(va * vb);
}

}  // namespace

std::optional<StreamOffset> find_offset(const RigStream& rig, const std::vector<ReferencePose>& reference,
                                        double from_s, double to_s, const Callback<bool()>& given_up) {
  const std::vector<Speed> speeds = marker_speeds(reference);
  const std::size_t stride = 1 + speeds.size() / 600;
  // Searches first as coarsely as speeds of a hand allow, and over fewer speeds if there is much to search.
  const std::size_t coarser = 1 + static_cast<std::size_t>((to_s - from_s) / kSpanWithAllSpeedsS);
  const std::size_t coarsest = std::max<std::size_t>(stride, speeds.size() / kFewestSpeeds);
  std::optional<StreamOffset> best;
  const auto search = [&](double low_s, double high_s, double step_s, std::size_t every) {
    for (double offset_s = low_s; offset_s <= high_s && !given_up(); offset_s += step_s) {
      const auto value = correlation(rig, speeds, every, offset_s);
      if (value && (!best || *value > best->correlation)) best = StreamOffset{offset_s, *value};
    }
  };
  search(from_s, to_s, kCoarseStepS, std::min(stride * coarser, coarsest));
  if (!best || given_up()) return std::nullopt;
  const double near_s = std::exchange(best, std::nullopt)->offset_s;
  search(near_s - 2.0 * kCoarseStepS, near_s + 2.0 * kCoarseStepS, kStepS, stride);
  return best;
}

std::optional<StreamOffset> find_any_offset(const RigStream& rig, const std::vector<ReferencePose>& reference,
                                            const Callback<bool()>& given_up) {
  if (rig.size() < 2 || reference.size() < 2) return std::nullopt;
  if (rig.end_s() - rig.begin_s() > kMaxSearchS) return std::nullopt;
  const double half_s = 0.5 * (reference.back().stamp_s - reference.front().stamp_s);
  return find_offset(rig, reference, reference.front().stamp_s - rig.end_s() + half_s,
                     reference.back().stamp_s - rig.begin_s() - half_s, given_up);
}

}  // namespace hapticd::calibration
