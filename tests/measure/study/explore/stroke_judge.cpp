#include "tests/measure/study/explore/stroke_judge.h"

#include <algorithm>

namespace hapticd::study {

namespace {
constexpr double kSlowHz = 10.0;
}

StrokeJudge::StrokeJudge(double rate_hz)
    : slow_(kSlowHz, rate_hz), window_ticks_(static_cast<std::size_t>(0.25 * rate_hz)) {}

void StrokeJudge::add(double displacement_mm) {
  if (ticks_ == 0) slow_.seed(displacement_mm);
  ++ticks_;
  const double fast_mm = displacement_mm - slow_.update(displacement_mm);
  if (in_window_ == 0) low_ = high_ = fast_mm;
  low_ = std::min(low_, fast_mm);
  high_ = std::max(high_, fast_mm);
  if (++in_window_ < window_ticks_) return;
  windows_mm_.push_back(high_ - low_);
  in_window_ = 0;
}

double StrokeJudge::swing_mm() const {
  if (windows_mm_.empty()) return 0.0;
  std::vector<double> sorted = windows_mm_;
  std::sort(sorted.begin(), sorted.end());
  return sorted[sorted.size() / 2];
}

}  // namespace hapticd::study
