#pragma once

#include <cstdint>

#include "client/cpp/clock/clock_converter.h"
#include "client/cpp/clock/clock_estimator.h"

namespace hapticd::client {

/// One clock in terms of another: the bounds of their offset, and conversions that neither jump nor run
/// backwards. Not for several threads at once.
class ClockLink {
 public:
  explicit ClockLink(double max_drift_ppm) : estimator_(max_drift_ppm) {}

  /// Adds an exchange as ClockEstimator::add(); if that fails, nothing is known any more.
  void add(const ClockExchange& exchange);
  void forget() { *this = ClockLink(estimator_.max_drift_ppm()); }

  bool empty() const noexcept { return estimator_.empty(); }
  const ClockEstimator& estimator() const noexcept { return estimator_; }

  struct Converted {
    std::int64_t ns = 0;
    double bound_ms = 0.0;  ///< how wrong it can be at most
  };
  /// Converts a time of the client's clock. Not while empty().
  Converted convert(std::int64_t client_ns);

 private:
  ClockEstimator estimator_;
  ClockConverter converter_;
};

}  // namespace hapticd::client
