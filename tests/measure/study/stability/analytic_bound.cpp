#include "tests/measure/study/stability/analytic_bound.h"

#include <numbers>

namespace hapticd::study {

LoopDelays loop_delays(double rate_hz, double proportional_gain, double amplifier_pole_hz, double latency_s) {
  const double period_s = 1.0 / rate_hz;
  LoopDelays delays;
  delays.position_s = 0.5 * period_s + period_s * (1.0 / proportional_gain - 1.0) +
                      1.0 / (2.0 * std::numbers::pi * amplifier_pole_hz) + latency_s;
  delays.force_s = delays.position_s + 0.45 * period_s;
  return delays;
}

double analytic_bound_n_per_mm(const LoopDelays& delays, double object_n_per_mm, double damping_n_s_per_mm) {
  return (damping_n_s_per_mm + delays.force_s * object_n_per_mm) / delays.position_s;
}

}  // namespace hapticd::study
