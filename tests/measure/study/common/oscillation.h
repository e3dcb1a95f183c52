#pragma once

#include <cstddef>
#include <optional>
#include <vector>

namespace hapticd::study {

/// Says whether what should rest oscillates: a tip's position or, with another `visible`, a force. Rule: in
/// windows of a quarter second, after taking out the straight line (creep and relaxation are not
/// oscillations), the peak-to-peak motion is more than `visible` in the last window and has not fallen below
/// half of what it was four windows (one second) before.
class OscillationJudge {
 public:
  static constexpr double kVisibleMm = 0.1;

  explicit OscillationJudge(double rate_hz, double visible = kVisibleMm);
  void add(double value);
  bool oscillates() const;
  /// True if it does, and more than twice as much as a second before.
  bool grows() const;
  /// Swing of the last full window, in the unit of what was added.
  double peak_to_peak() const { return windows_.empty() ? 0.0 : windows_.back(); }

 private:
  /// Peak to peak a second before the last window; none if it was not watched for that long.
  std::optional<double> a_second_before() const;

  double visible_;
  std::size_t window_ticks_;
  std::vector<double> window_;
  std::vector<double> windows_;  ///< peak to peak of each
};

}  // namespace hapticd::study
