#pragma once

#include <vector>

#include "rt/signal/butterworth_low_pass.h"

namespace hapticd::study {

/// Says how much a stroking tip swings: median over windows of a quarter second of the peak-to-peak
/// displacement above 10 Hz. Curvature, creep and the hand's force control are slower; the turn of a stroke
/// is one window in several, and the median passes over it.
class StrokeJudge {
 public:
  /// Limit cycles here are millimetres wide; what noise and texture do stays below this.
  static constexpr double kLimitCycleMm = 0.5;

  explicit StrokeJudge(double rate_hz);

  void add(double displacement_mm);
  /// The detector missed a contact in this tick.
  void lost() { ++lost_; }

  double swing_mm() const;
  double lost_share() const {
    return ticks_ > 0 ? static_cast<double>(lost_) / static_cast<double>(ticks_) : 0.0;
  }

 private:
  rt::ButterworthLowPass slow_;
  std::size_t window_ticks_;
  std::size_t ticks_ = 0;
  std::size_t lost_ = 0;
  std::size_t in_window_ = 0;
  double low_ = 0.0;
  double high_ = 0.0;
  std::vector<double> windows_mm_;
};

}  // namespace hapticd::study
