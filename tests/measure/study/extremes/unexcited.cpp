#include <cmath>
#include <cstdint>
#include <limits>
#include <utility>

#include "hal/sim/base/random.h"
#include "rt/deformation/fused_displacement.h"
#include "rt/deformation/tracked_direction.h"
#include "server/identification/estimate/contact/contact_single_stage.h"
#include "tests/measure/study/extremes/extreme.h"
#include "tests/measure/study/extremes/palpated.h"
#include "tests/reference/contact_double_stage.h"

namespace hapticd::study::extremes {

namespace {

constexpr double kForgetting = 0.9997;
constexpr double kNoiseN = 0.003;
constexpr double kMaxDepthMm = 4.0;
constexpr rt::HuntCrossleyParameters kLaw{0.4, 4e-4, 1.5};

/// 20 s of presses, one depth held for ten hours, 20 s of presses.
template <class Add>
void palpate_hold_palpate(const Effort& effort, const Add& add) {
  const auto palpate = [&](std::uint64_t seed) {
    for (const identification::PalpationSample& s : palpated(kLaw, kMaxDepthMm, 20.0, kNoiseN, seed)) add(s);
  };
  palpate(1);
  sim::Random random(2);
  identification::PalpationSample held;
  held.displacement_mm = 0.6 * kMaxDepthMm;
  held.in_contact = true;
  const double force_n = rt::hunt_crossley_force_n(kLaw, held.displacement_mm, 0.0);
  const long ticks = effort.ticks(10.0);
  for (long tick = 0; tick < ticks; ++tick) {
    held.normal_force_n = force_n + kNoiseN * random.normal();
    held.time_s = 20.0 + 1e-3 * static_cast<double>(tick);
    add(held);
  }
  palpate(3);
}

/// Error of the displacement at half the depth (of the direction below, rad).
template <class Estimator>
double law_error(const Effort& effort, Estimator estimator) {
  palpate_hold_palpate(effort, [&](const identification::PalpationSample& s) { estimator.add(s); });
  const auto found = estimator.estimate();
  if (!found) return std::numeric_limits<double>::quiet_NaN();
  const double force_n = rt::hunt_crossley_force_n(kLaw, 0.5 * kMaxDepthMm, 0.0);
  const double mm =
      std::pow(force_n / found->parameters.stiffness_n_per_mm_m, 1.0 / found->parameters.exponent);
  return std::abs(mm / (0.5 * kMaxDepthMm) - 1.0);
}

double double_stage(const Effort& effort) {
  return law_error(effort, identification::DoubleStageEstimator());
}
double single_stage(const Effort& effort) {
  identification::SingleStageEstimator::Options options;
  options.forgetting = kForgetting;
  return law_error(effort, identification::SingleStageEstimator(options));
}
double single_stage_shipped(const Effort& effort) {
  return law_error(effort, identification::SingleStageEstimator());
}

double fused(const Effort& effort) {
  rt::FusedDisplacement displacement(0.05, kNoiseN, 1000.0);
  displacement.begin(0.0, 0.05);
  double truth_mm = 0.0;
  palpate_hold_palpate(effort, [&](const identification::PalpationSample& s) {
    const double step_mm = s.displacement_mm - std::exchange(truth_mm, s.displacement_mm);
    displacement.update(step_mm, 0.1 * std::abs(step_mm),
                        rt::hunt_crossley_displacement(kLaw, s.normal_force_n, s.rate_mm_per_s));
  });
  return std::abs(displacement.displacement_mm() / truth_mm - 1.0);
}

double tracked(const Effort& effort) {
  rt::TrackedDirection direction({0.3, 0.3, 0.0}, kNoiseN, 1000.0);
  direction.begin({0.0, 0.0, 0.1});
  double before_mm = 0.0;
  palpate_hold_palpate(effort, [&](const identification::PalpationSample& s) {
    direction.update({0.0, 0.0, s.normal_force_n}, {0.0, 0.0, before_mm - s.displacement_mm},
                     {0.0, 0.0, -s.rate_mm_per_s});
    before_mm = s.displacement_mm;
  });
  const hal::Vector3& n = direction.normal();
  return std::atan2(std::hypot(n.x, n.y), n.z);
}

}  // namespace

/// An estimator that rest has not spoilt errs by 10 % at most, once it is excited again.
ExtremeGroup unexcited_extremes() {
  const auto extreme = [](const char* stage, double (*measure)(const Effort&)) {
    return Extreme{stage,
                   "ten hours without excitation, then excited",
                   "error of what it gives",
                   "1",
                   0.1,
                   "10 %: an estimator that the rest has not spoilt",
                   measure};
  };
  return {"unexcited",
          "Recursive estimators without excitation",
          {extreme("recursive double stage, λ 0.9997", double_stage),
           extreme("recursive single stage, λ 0.9997", single_stage),
           extreme("recursive single stage, λ 1 (default)", single_stage_shipped),
           extreme("fused displacement", fused), extreme("tracked direction", tracked)}};
}

}  // namespace hapticd::study::extremes
