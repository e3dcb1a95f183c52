#pragma once

#include "rt/signal/butterworth_low_pass.h"

namespace hapticd::study {

/// Ways to a velocity that hapticd does not ship. Each takes one position a tick, the first at rest.

/// (y_k - y_{k-1}) / T.
class PlainDifference {
 public:
  explicit PlainDifference(double rate_hz) noexcept : rate_hz_(rate_hz) {}

  double update(double position_mm) noexcept {
    const double velocity = started_ ? (position_mm - last_mm_) * rate_hz_ : 0.0;
    started_ = true;
    last_mm_ = position_mm;
    return velocity;
  }

 private:
  double rate_hz_;
  bool started_ = false;
  double last_mm_ = 0.0;
};

/// The difference through a second-order Butterworth low-pass.
class FilteredDifference {
 public:
  FilteredDifference(double cutoff_hz, double rate_hz) noexcept
      : difference_(rate_hz), filter_(cutoff_hz, rate_hz) {}
  double update(double position_mm) noexcept { return filter_.update(difference_.update(position_mm)); }

 private:
  PlainDifference difference_;
  rt::ButterworthLowPass filter_;
};

}  // namespace hapticd::study
