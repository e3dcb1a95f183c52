#include "server/calibration/estimate/stream_offset.h"

#include <algorithm>
#include <cmath>
#include <cstddef>

namespace hapticd::calibration {

namespace {

constexpr double kStepS = 0.005;
constexpr double kSpanS = 0.1;  ///< over which a speed is taken: noise of 0.3 mm is 4 mm/s then
constexpr std::size_t kMinSpeeds = 30;

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
                                        double from_s, double to_s) {
  const std::vector<Speed> speeds = marker_speeds(reference);
  const std::size_t stride = 1 + speeds.size() / 600;
  std::optional<StreamOffset> best;
  // First as coarse as speeds of a hand allow, then finer about the best.
  for (const double step_s : {0.02, kStepS}) {
    const double low_s = best && step_s == kStepS ? best->offset_s - 0.04 : from_s;
    const double high_s = best && step_s == kStepS ? best->offset_s + 0.04 : to_s;
    for (double offset_s = low_s; offset_s <= high_s; offset_s += step_s) {
      const auto value = correlation(rig, speeds, stride, offset_s);
      if (value && (!best || *value > best->correlation)) best = StreamOffset{offset_s, *value};
    }
    if (!best) return std::nullopt;
  }
  return best;
}

}  // namespace hapticd::calibration
