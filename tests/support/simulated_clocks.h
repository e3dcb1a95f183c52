#pragma once

#include <cstdint>
#include <random>

namespace hapticd::test {

/// Stamps as an exchange gives them, in ns.
struct SimulatedStamps {
  std::int64_t client_sent_ns = 0;
  std::int64_t daemon_received_ns = 0;
  std::int64_t daemon_sent_ns = 0;
  std::int64_t client_received_ns = 0;
};

/// How long messages take: at least, and a random time more (exponential, its mean); one of `rare` takes
/// `stall_ns` more.
struct SimulatedDelay {
  double least_ns = 0.0;
  double more_ns = 0.0;
  double rare = 0.0;
  double stall_ns = 0.0;
};

/// Two clocks in virtual time, and a network between them. The client's clock is the true time; that of the
/// daemon runs apart from it by up to a stated drift, in steps between its extremes. Shares no code with what
/// estimates.
class SimulatedClocks {
 public:
  SimulatedClocks(std::int64_t offset_ns, double max_drift_ppm, std::uint64_t seed);

  /// Sets the delays of the way there and the way back, from now on.
  void set_delays(SimulatedDelay there, SimulatedDelay back);
  /// Keeps to one drift from now on.
  void fix_drift(double ppm);
  void pass(std::int64_t ns);
  SimulatedStamps exchange();

  std::int64_t client_ns() const { return client_ns_; }
  /// The true time of the daemon's clock, in whole ns.
  std::int64_t daemon_ns() const;
  /// Whether the true offset lies between the two.
  bool is_offset_within(std::int64_t lower_ns, std::int64_t upper_ns) const;

 private:
  std::int64_t draw(const SimulatedDelay& delay);

  std::mt19937_64 random_;
  std::int64_t client_ns_ = 0;
  std::int64_t begin_offset_ns_;
  double apart_ns_ = 0.0;  ///< of the offset, since the beginning
  double max_drift_;
  double drift_ = 0.0;
  bool drift_is_fixed_ = false;
  std::int64_t drift_until_ns_ = 0;
  SimulatedDelay there_;
  SimulatedDelay back_;
};

}  // namespace hapticd::test
