#pragma once

#include <algorithm>
#include <cmath>

namespace hapticd::identification {

/// Rule by which a repeated force is taken for the end of a range that is not known.
struct ClipPolicy {
  int run = 0;                        ///< so many repetitions to the last bit of the largest force; 0 = off
  double moved_mm = 0.0;              ///< while the tip moves by more than this,
  double moved_share_of_range = 0.0;  ///< or than this share of all it moved
  bool refuses = false;               ///< such samples are left out; else they are counted only
};

/// Detects a sensor at the end of its range by forces that repeat at their extreme while the tip moves.
class ClipMonitor {
 public:
  explicit ClipMonitor(const ClipPolicy& policy) noexcept : policy_(policy) {}

  bool clipped(double force_n, double position_mm) noexcept {
    if (policy_.run == 0) return false;
    const double magnitude = std::abs(force_n);
    min_mm_ = std::min(min_mm_, position_mm);
    max_mm_ = std::max(max_mm_, position_mm);
    largest_n_ = std::max(largest_n_, magnitude);
    if (force_n == last_n_ && magnitude > 0.0 && magnitude >= largest_n_) {
      ++run_;
    } else {
      run_ = 0;
      run_from_mm_ = position_mm;
    }
    last_n_ = force_n;
    const double moved_mm = std::max(policy_.moved_mm, policy_.moved_share_of_range * (max_mm_ - min_mm_));
    return run_ >= policy_.run && std::abs(position_mm - run_from_mm_) > moved_mm;
  }

 private:
  ClipPolicy policy_;
  double last_n_ = 0.0, largest_n_ = 0.0, run_from_mm_ = 0.0;
  double min_mm_ = 0.0, max_mm_ = 0.0;
  int run_ = 0;
};

}  // namespace hapticd::identification
