#include "tests/measure/study/common/oscillation.h"

#include <algorithm>

namespace hapticd::study {

namespace {
/// Peak to peak about the least-squares line.
double swing(const std::vector<double>& positions) {
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

OscillationJudge::OscillationJudge(double rate_hz, double visible)
    : visible_(visible), window_ticks_(static_cast<std::size_t>(0.25 * rate_hz)) {}

void OscillationJudge::add(double value) {
  window_.push_back(value);
  if (window_.size() < window_ticks_) return;
  windows_.push_back(swing(window_));
  window_.clear();
}

std::optional<double> OscillationJudge::a_second_before() const {
  constexpr std::size_t kWindowsPerSecond = 4;
  if (windows_.size() <= kWindowsPerSecond) return std::nullopt;
  return windows_[windows_.size() - 1 - kWindowsPerSecond];
}

bool OscillationJudge::oscillates() const {
  return peak_to_peak() > visible_ && peak_to_peak() >= 0.5 * a_second_before().value_or(0.0);
}

bool OscillationJudge::grows() const {
  const std::optional<double> before = a_second_before();
  return peak_to_peak() > visible_ && before && peak_to_peak() > 2.0 * *before;
}

}  // namespace hapticd::study
