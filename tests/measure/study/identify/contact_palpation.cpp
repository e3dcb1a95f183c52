#include "tests/measure/study/identify/contact_palpation.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "hal/sim/simulated_rig.h"
#include "server/identification/gate/palpation_tracker.h"
#include "server/identification/palpation/simulated_palpator.h"
#include "tests/measure/study/common/plant.h"
#include "tests/measure/study/common/scenes.h"
#include "tests/reference/creep_force.h"
#include "tests/support/value_of.h"

namespace hapticd::study {

namespace {

using test::demand;
using test::value_of;

constexpr double kNone = std::numeric_limits<double>::quiet_NaN();

identification::MotionRequest press(double force_n, double rate_n_per_s, double hold_s) {
  identification::MotionRequest request;
  request.motion = identification::MotionRequest::Motion::kPress;
  request.force_n = force_n;
  request.force_rate_n_per_s = rate_n_per_s;
  request.hold_s = hold_s;
  return request;
}

ContactErrors errors_of(const std::vector<double>& force_n, const std::vector<double>& displacement_mm,
                        const TruePalpation& palpation) {
  ContactErrors errors;
  double deepest_mm = 0.0;
  for (const double x : palpation.true_displacement_mm) deepest_mm = std::max(deepest_mm, x);
  double off_n = 0.0, sum_n = 0.0, by_sample = 0.0;
  std::size_t samples = 0;
  std::vector<double> relative;
  for (std::size_t i = 0; i < palpation.samples.size(); ++i) {
    const identification::PalpationSample& s = palpation.samples[i];
    if (!s.in_contact || !(s.normal_force_n > 0.0)) continue;
    const double error_n = std::abs(force_n[i] - s.normal_force_n);
    off_n += error_n;
    sum_n += s.normal_force_n;
    if (s.normal_force_n > 0.2) {
      by_sample += error_n / s.normal_force_n;
      ++samples;
    }
    const double x = palpation.true_displacement_mm[i];
    if (x > 0.1 * deepest_mm) relative.push_back(std::abs(displacement_mm[i] / x - 1.0));
  }
  errors.force = off_n / sum_n;
  errors.force_by_sample = by_sample / static_cast<double>(samples);
  double sum = 0.0;
  for (const double e : relative) sum += e;
  errors.displacement = sum / static_cast<double>(relative.size());
  std::nth_element(relative.begin(), relative.begin() + static_cast<std::ptrdiff_t>(relative.size() / 2),
                   relative.end());
  errors.displacement_median = relative[relative.size() / 2];
  return errors;
}

}  // namespace

TruePalpation palpate(const std::string& object, const std::vector<identification::MotionRequest>& requests,
                      std::uint64_t seed) {
  sim::SimulationConfig config = explore_rig("phantom_1_5_high_force", object, "rod");
  config.seed = seed;
  const auto rig = value_of(create_rig(config));
  const hal::RigInfo& info = rig->info();
  identification::PalpationTracker tracker(info.sensor.tool_mass_g, 0.02, info.device.position_resolution_mm,
                                           info.rate_hz);
  TruePalpation palpation;
  hal::RigSample sample;
  hal::TruthSample truth;
  double until_s = 0.0;
  for (const identification::MotionRequest& request : requests) {
    const server::SimulatedMotion motion = server::simulated_motion(request);
    demand(rig->set_program(motion.program));
    until_s += motion.duration_s;
    while (1e-9 * static_cast<double>(sample.time_ns) < until_s) {
      rig->read(sample);
      rig->write({});
      rig->truth(truth);
      palpation.samples.push_back(tracker.update(sample));
      palpation.true_displacement_mm.push_back(truth.displacement_mm);
    }
  }
  return palpation;
}

const std::vector<identification::MotionRequest>& validation_requests() {
  static const std::vector<identification::MotionRequest> requests{
      press(1.5, 3.0, 0.2), press(4.5, 12.0, 0.4), press(5.5, 4.0, 0.1), press(3.0, 20.0, 0.2)};
  return requests;
}

std::vector<double> predicted_force_n(const rt::HuntCrossleyParameters& law,
                                      const std::vector<identification::PalpationSample>& palpation) {
  std::vector<double> force_n;
  for (const identification::PalpationSample& s : palpation) {
    force_n.push_back(s.in_contact ? rt::hunt_crossley_force_n(law, s.displacement_mm, s.rate_mm_per_s)
                                   : kNone);
  }
  return force_n;
}

std::vector<double> predicted_force_n(const rt::CreepParameters& law,
                                      const std::vector<identification::PalpationSample>& palpation) {
  std::vector<double> force_n;
  identification::CreepForce inverse(law);
  double last_s = palpation.empty() ? 0.0 : palpation.front().time_s - 1e-3;
  for (const identification::PalpationSample& s : palpation) {
    const double f = inverse.update(s.in_contact ? s.displacement_mm : 0.0, s.time_s - last_s);
    last_s = s.time_s;
    force_n.push_back(s.in_contact ? f : kNone);
  }
  return force_n;
}

ContactErrors errors_of(const rt::HuntCrossleyParameters& law, const TruePalpation& palpation) {
  std::vector<double> displacement_mm;
  for (const identification::PalpationSample& s : palpation.samples) {
    displacement_mm.push_back(
        rt::hunt_crossley_displacement(law, s.normal_force_n, s.rate_mm_per_s).displacement_mm);
  }
  return errors_of(predicted_force_n(law, palpation.samples), displacement_mm, palpation);
}

ContactErrors errors_of(const rt::CreepParameters& law, const TruePalpation& palpation) {
  rt::CreepLaw run(law, 1000.0);
  std::vector<double> displacement_mm;
  for (const identification::PalpationSample& s : palpation.samples) {
    displacement_mm.push_back(run.update(s.in_contact ? s.normal_force_n : 0.0).displacement_mm);
  }
  return errors_of(predicted_force_n(law, palpation.samples), displacement_mm, palpation);
}

}  // namespace hapticd::study
