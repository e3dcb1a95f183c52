#pragma once

#include <vector>

namespace hapticd::study {

/// Says whether a tip that should rest oscillates. Rule: in windows of a quarter second, after taking out the
/// straight line (creep and relaxation are no oscillation), the peak-to-peak motion is more than 0.1 mm in
/// the last window and has not fallen below half of what it was four windows (one second) before.
class OscillationJudge {
 public:
  static constexpr double kVisibleMm = 0.1;

  explicit OscillationJudge(double rate_hz);
  void add(double position_mm);
  bool oscillates() const;
  /// Of the last full window.
  double peak_to_peak_mm() const { return windows_mm_.empty() ? 0.0 : windows_mm_.back(); }

 private:
  std::size_t window_ticks_;
  std::vector<double> window_;
  std::vector<double> windows_mm_;
};

}  // namespace hapticd::study
