#pragma once

#include <cstdint>
#include <optional>
#include <vector>

namespace hapticd::client {

/// The four stamps of one exchange, in ns: the outer ones by the client's clock, the inner ones by the
/// daemon's.
struct ClockExchange {
  std::int64_t client_sent_ns = 0;
  std::int64_t daemon_received_ns = 0;
  std::int64_t daemon_sent_ns = 0;
  std::int64_t client_received_ns = 0;
};

/// Bounds of the offset (daemon's clock minus client's) at one time.
struct ClockBounds {
  std::int64_t client_ns = 0;  ///< the time, by the client's clock
  std::int64_t lower_ns = 0;
  std::int64_t upper_ns = 0;

  /// The middle: no other estimate has a smaller largest error.
  std::int64_t offset_ns() const noexcept { return lower_ns + (upper_ns - lower_ns) / 2; }
  /// How wrong the middle can be at most.
  double bound_ms() const noexcept { return 0.5e-6 * static_cast<double>(upper_ns - lower_ns + 1); }
};

/// How fast the offset changes, on average over a time.
struct ClockDrift {
  double ppm = 0.0;        ///< positive: the daemon's clock is the faster one
  double bound_ppm = 0.0;  ///< how wrong this can be at most
  double over_s = 0.0;     ///< the time; 0 = not known yet
};

/// Bounds of the offset between two clocks, from exchanges of stamps.
///
/// A message never arrives before it was sent. So each exchange gives two bounds: the way there an upper one,
/// the way back a lower one, whatever the delays are and however they differ. The intersection of all is
/// kept; each bound widens with its age, by the largest drift that is stated. The true offset is inside as
/// long as the clocks keep to it. A network time daemon may make a clock run 500 ppm off, and more while it
/// starts.
///
/// Knows no clock and no network. Not for several threads at once.
class ClockEstimator {
 public:
  static constexpr double kDefaultMaxDriftPpm = 200.0;

  /// `max_drift_ppm`: of one clock against the other, 0.001 … 10000. Throws Error (kBadClock) otherwise.
  explicit ClockEstimator(double max_drift_ppm = kDefaultMaxDriftPpm);

  /// Adds an exchange; exchanges follow one another. Throws Error (kBadClock) if a clock ran backwards, a
  /// stamp is absurd (beyond 73 years), or the clocks run apart faster than stated: what was known is
  /// forgotten, and the next exchange begins afresh.
  void add(const ClockExchange& exchange);

  bool empty() const noexcept { return !known_; }
  /// Bounds at a time of the client's clock. Not while empty().
  ClockBounds bounds(std::int64_t client_ns) const;
  /// Drift over the last ten minutes at most; the largest one stated, ±, before there is more than one
  /// second.
  ClockDrift drift() const;
  double max_drift_ppm() const noexcept { return max_drift_ppm_; }

 private:
  /// A bound, and the client's time at which it holds.
  struct Bound {
    std::int64_t offset_ns = 0;
    std::int64_t client_ns = 0;
  };

  std::int64_t widened(std::int64_t age_ns) const;
  void check(const ClockExchange& exchange) const;
  void note(const ClockBounds& now);

  double max_drift_ppm_;
  bool known_ = false;
  ClockExchange last_;
  Bound upper_;
  Bound lower_;
  std::vector<ClockBounds> history_;  ///< oldest first
};

}  // namespace hapticd::client
