#pragma once

#include <algorithm>
#include <cmath>

namespace hapticd::rt {

/// Straight line along which the points of late lie, and between which bounds they lie aside of it. A motion
/// that was even mostly is so still: then a look at the newest point is enough.
struct EvenLine {
  double from_periods = 0.0;
  double from_mm = 0.0;
  double slope = 0.0;     ///< mm a period
  double least_mm = 0.0;  ///< aside of it
  double most_mm = HUGE_VAL;

  /// Takes the next point; true if it and those before it lie within a band of `width_mm` along the line.
  bool takes(double periods, double mm, double width_mm) noexcept {
    const double aside_mm = mm - from_mm - slope * (periods - from_periods);
    least_mm = std::min(least_mm, aside_mm);
    most_mm = std::max(most_mm, aside_mm);
    return this->width_mm() <= width_mm;
  }
  double width_mm() const noexcept { return most_mm - least_mm; }
  /// No line: none holds the next point.
  void forget() noexcept { most_mm = HUGE_VAL; }
};

}  // namespace hapticd::rt
