#include "tests/study/rig/oscillation.h"

#include <algorithm>
#include <cmath>

namespace hapticd::study {

namespace {
/// Peak to peak about the least-squares line.
double swing_mm(const std::vector<double>& positions) {
  const double n = static_cast<double>(positions.size());
  const double middle = 0.5 * (n - 1.0);
  double mean = 0.0;
  for (const double p : positions) mean += p / n;
  double moment = 0.0;
  double inertia = 0.0;
  for (std::size_t i = 0; i < positions.size(); ++i) {
    const double t = static_cast<double>(i) - middle;
    moment += t * (positions[i] - mean);
    inertia += t * t;
  }
  const double slope = moment / inertia;
  double low = 0.0;
  double high = 0.0;
  for (std::size_t i = 0; i < positions.size(); ++i) {
    const double rest = positions[i] - mean - slope * (static_cast<double>(i) - middle);
    low = std::min(low, rest);
    high = std::max(high, rest);
  }
  return high - low;
}
}  // namespace

OscillationJudge::OscillationJudge(double rate_hz)
    : window_ticks_(static_cast<std::size_t>(0.25 * rate_hz)) {}

void OscillationJudge::add(double position_mm) {
  window_.push_back(position_mm);
  if (window_.size() < window_ticks_) return;
  windows_mm_.push_back(swing_mm(window_));
  window_.clear();
}

bool OscillationJudge::oscillates() const {
  constexpr std::size_t kWindowsPerSecond = 4;
  if (windows_mm_.empty() || windows_mm_.back() <= kVisibleMm) return false;
  if (windows_mm_.size() <= kWindowsPerSecond) return true;
  return windows_mm_.back() >= 0.5 * windows_mm_[windows_mm_.size() - 1 - kWindowsPerSecond];
}

}  // namespace hapticd::study
