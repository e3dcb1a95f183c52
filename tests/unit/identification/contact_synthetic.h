#pragma once

#include <cmath>
#include <numbers>
#include <random>
#include <vector>

#include "hal/samples.h"
#include "rt/deformation/creep_law.h"
#include "rt/deformation/hunt_crossley.h"
#include "rt/record/observation.h"
#include "server/identification/gate/palpation_sample.h"
#include "tests/support/value_of.h"

namespace hapticd::identification::test {

using hapticd::test::value_of;

/// Smooth presses of given depths and rates, with pauses outside of the object in between.
struct SyntheticPress {
  double depth_mm, hz;
  int repetitions;
};
inline const std::vector<SyntheticPress>& mixed_presses() {
  static const std::vector<SyntheticPress> presses{{0.5, 0.5, 1}, {1.0, 0.1, 1}, {1.0, 0.4, 2},
                                                   {0.8, 1.2, 3}, {1.0, 2.5, 4}, {0.6, 0.8, 2}};
  return presses;
}

/// What happens at time t: depth below the surface (negative outside) and its rate.
struct SyntheticMotion {
  double depth_mm, rate_mm_per_s;
};

/// `scale_mm`: depth of a press of depth 1. Free for half a second first.
inline std::vector<SyntheticMotion> synthetic_motion(const std::vector<SyntheticPress>& presses,
                                                     double scale_mm, double rate_hz = 1000.0) {
  std::vector<SyntheticMotion> motion(static_cast<std::size_t>(0.5 * rate_hz), {-1.0, 0.0});
  for (const SyntheticPress& p : presses) {
    const double omega = 2.0 * std::numbers::pi * p.hz;
    const double height = p.depth_mm * scale_mm + 1.0;
    const auto ticks = static_cast<int>(rate_hz * p.repetitions / p.hz);
    for (int i = 0; i < ticks; ++i) {
      const double t = i / rate_hz;
      motion.push_back(
          {0.5 * height * (1.0 - std::cos(omega * t)) - 1.0, 0.5 * height * omega * std::sin(omega * t)});
    }
  }
  return motion;
}

/// Samples of a Hunt-Crossley law under that motion, with noise that hangs together over `correlation_s`.
inline std::vector<PalpationSample> synthetic_palpation(const rt::HuntCrossleyParameters& law,
                                                        double scale_mm, double noise_n = 0.0,
                                                        double correlation_s = 0.0, std::uint64_t seed = 1,
                                                        double rate_hz = 1000.0) {
  std::mt19937_64 random(seed);
  std::normal_distribution<double> normal(0.0, 1.0);
  const double keep = correlation_s > 0.0 ? std::exp(-1.0 / (correlation_s * rate_hz)) : 0.0;
  double noise = 0.0;
  std::vector<PalpationSample> samples;
  for (const SyntheticMotion& m : synthetic_motion(mixed_presses(), scale_mm, rate_hz)) {
    noise = keep * noise + std::sqrt(1.0 - keep * keep) * normal(random);
    PalpationSample s{
        .displacement_mm = m.depth_mm,
        .rate_mm_per_s = m.rate_mm_per_s,
        .normal_force_n = rt::hunt_crossley_force_n(law, m.depth_mm, m.rate_mm_per_s) + noise_n * noise,
        .in_contact = m.depth_mm > 0.0,
        .time_s = static_cast<double>(samples.size()) / rate_hz};
    samples.push_back(s);
  }
  return samples;
}

/// Observations as a rig would deliver them: encoders of `step_mm`, sensor noise, the surface at -3 mm.
inline std::vector<rt::Observation> synthetic_observations(const rt::HuntCrossleyParameters& law,
                                                           double scale_mm, double noise_n = 0.003,
                                                           double step_mm = 0.007, double rate_hz = 1000.0) {
  std::mt19937_64 random(5);
  std::normal_distribution<double> normal(0.0, 1.0);
  std::vector<rt::Observation> observations;
  for (const SyntheticMotion& m : synthetic_motion(mixed_presses(), scale_mm, rate_hz)) {
    rt::Observation o;
    const double depth = m.depth_mm + 3.0;
    o.sample.tick = observations.size();
    o.sample.time_ns = std::llround(1e9 * static_cast<double>(observations.size()) / rate_hz);
    o.sample.tip_position_mm.z = -(step_mm > 0.0 ? step_mm * std::round(depth / step_mm) : depth);
    o.sample.sensor_force_n.z =
        rt::hunt_crossley_force_n(law, m.depth_mm, m.rate_mm_per_s) + noise_n * normal(random);
    o.sample.force_count = 10;
    observations.push_back(o);
  }
  return observations;
}

/// rms of x̂/x - 1 against the true law at rest, beyond a tenth of the deepest. `late_mm`: so far behind the
/// true surface the found law counts from; what a threshold of force sees late on a soft onset.
inline double law_displacement_error(const rt::HuntCrossleyParameters& truth,
                                     const rt::HuntCrossleyParameters& found, double deepest_mm,
                                     double late_mm = 0.0) {
  double sum = 0.0;
  int count = 0;
  for (double x = 0.1 * deepest_mm; x <= deepest_mm; x += 0.01 * deepest_mm) {
    const double f = rt::hunt_crossley_force_n(truth, x + late_mm, 0.0);
    sum += std::pow(rt::hunt_crossley_displacement(found, f, 0.0).displacement_mm / x - 1.0, 2);
    ++count;
  }
  return std::sqrt(sum / count);
}

/// An object that creeps, up to 9 mm at 2 N.
inline rt::CreepParameters some_creep() {
  rt::CreepParameters law{.weight = {0.55, 0.1, 0.15, 0.1, 0.1}, .max_force_n = 2.0};
  for (std::size_t j = 0; j < rt::CreepParameters::kKnots; ++j) {
    const double share = std::pow(static_cast<double>(j) / 16.0, 2);
    law.displacement_mm[j] = 9.0 * (0.7 * std::pow(share, 0.6) + 0.3 * share);
  }
  return law;
}

}  // namespace hapticd::identification::test
