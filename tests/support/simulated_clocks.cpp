#include "tests/support/simulated_clocks.h"

#include <algorithm>
#include <cmath>

namespace hapticd::test {

SimulatedClocks::SimulatedClocks(std::int64_t offset_ns, double max_drift_ppm, std::uint64_t seed)
    : random_(seed), begin_offset_ns_(offset_ns), max_drift_(1e-6 * max_drift_ppm) {}

void SimulatedClocks::set_delays(SimulatedDelay there, SimulatedDelay back) {
  there_ = there;
  back_ = back;
}

void SimulatedClocks::fix_drift(double ppm) {
  drift_ = 1e-6 * ppm;
  drift_is_fixed_ = true;
}

void SimulatedClocks::pass(std::int64_t ns) {
  while (ns > 0) {
    if (!drift_is_fixed_ && client_ns_ >= drift_until_ns_) {
      // Mostly at an extreme, for 0.1 s to 100 s.
      const auto choice = std::uniform_int_distribution<int>(0, 4)(random_);
      drift_ = choice <= 1   ? max_drift_
               : choice <= 3 ? -max_drift_
                             : std::uniform_real_distribution<double>(-max_drift_, max_drift_)(random_);
      const double exponent = std::uniform_real_distribution<double>(8.0, 11.0)(random_);
      drift_until_ns_ = client_ns_ + static_cast<std::int64_t>(std::pow(10.0, exponent));
    }
    const std::int64_t step = drift_is_fixed_ ? ns : std::min(ns, drift_until_ns_ - client_ns_);
    client_ns_ += step;
    apart_ns_ += drift_ * static_cast<double>(step);
    ns -= step;
  }
}

std::int64_t SimulatedClocks::daemon_ns() const {
  return client_ns_ + begin_offset_ns_ + static_cast<std::int64_t>(std::floor(apart_ns_));
}

bool SimulatedClocks::is_offset_within(std::int64_t lower_ns, std::int64_t upper_ns) const {
  return static_cast<double>(lower_ns - begin_offset_ns_) <= apart_ns_ &&
         apart_ns_ <= static_cast<double>(upper_ns - begin_offset_ns_);
}

std::int64_t SimulatedClocks::draw(const SimulatedDelay& delay) {
  double ns = delay.least_ns;
  if (delay.more_ns > 0.0) ns += std::exponential_distribution<double>(1.0 / delay.more_ns)(random_);
  if (std::uniform_real_distribution<double>(0.0, 1.0)(random_) < delay.rare) ns += delay.stall_ns;
  return static_cast<std::int64_t>(ns);
}

SimulatedStamps SimulatedClocks::exchange() {
  constexpr std::int64_t kServingNs = 5'000;
  SimulatedStamps stamps{.client_sent_ns = client_ns()};
  pass(draw(there_));
  stamps.daemon_received_ns = daemon_ns();
  pass(kServingNs);
  stamps.daemon_sent_ns = daemon_ns();
  pass(draw(back_));
  stamps.client_received_ns = client_ns();
  return stamps;
}

}  // namespace hapticd::test
