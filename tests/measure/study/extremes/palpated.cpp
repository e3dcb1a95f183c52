#include "tests/measure/study/extremes/palpated.h"

#include <cmath>
#include <numbers>

#include "hal/sim/base/random.h"

namespace hapticd::study::extremes {

std::vector<identification::PalpationSample> palpated(const rt::HuntCrossleyParameters& law,
                                                      double deepest_mm, double seconds, double noise_n,
                                                      std::uint64_t seed) {
  sim::Random random(seed);
  std::vector<identification::PalpationSample> samples;
  const auto ticks = static_cast<int>(1000.0 * seconds);
  for (int i = 0; i < ticks; ++i) {
    // A press that swells and fades over 5 s, at a rate that wanders between 0.2 and 1 Hz.
    const double t = 1e-3 * i;
    const double two_pi = 2.0 * std::numbers::pi;
    const double depth = 0.65 - 0.35 * std::cos(two_pi * 0.2 * t);
    const double depth_rate = 0.35 * two_pi * 0.2 * std::sin(two_pi * 0.2 * t);
    const double phase = two_pi * 0.6 * t + 2.0 * std::sin(two_pi * 0.1 * t);
    const double phase_rate = two_pi * 0.6 + 2.0 * two_pi * 0.1 * std::cos(two_pi * 0.1 * t);
    identification::PalpationSample s;
    s.displacement_mm = 0.5 * deepest_mm * depth * (1.05 - std::cos(phase));
    s.rate_mm_per_s =
        0.5 * deepest_mm * (depth_rate * (1.05 - std::cos(phase)) + depth * phase_rate * std::sin(phase));
    s.normal_force_n =
        rt::hunt_crossley_force_n(law, s.displacement_mm, s.rate_mm_per_s) + noise_n * random.normal();
    s.in_contact = true;
    s.time_s = t;
    samples.push_back(s);
  }
  return samples;
}

}  // namespace hapticd::study::extremes
