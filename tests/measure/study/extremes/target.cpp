#include <algorithm>
#include <cmath>
#include <complex>

#include "hal/sim/base/random.h"
#include "rt/control/force_controller.h"
#include "rt/target/desired_force.h"
#include "rt/target/feasible_range.h"
#include "rt/target/release_fade.h"
#include "rt/target/target_blend.h"
#include "rt/target/target_law.h"
#include "rt/target/target_ramp.h"
#include "tests/measure/study/extremes/extreme.h"

namespace hapticd::study::extremes {

namespace {

constexpr double kRateHz = 1000.0;

double profile_of_a_spring(const Effort&) {
  // Knots wherever, all on one stiffness: the integral is k x.
  Largest largest;
  sim::Random random(1);
  for (int trial = 0; trial < 20'000; ++trial) {
    rt::TargetLaw law;
    law.kind = rt::TargetLaw::Kind::kDisplacementProfile;
    law.knot_count = 1 + static_cast<std::uint32_t>(15.0 * random.uniform());
    const double stiffness = std::pow(10.0, 7.0 * random.uniform() - 4.0);
    double at = 0.0;
    for (std::uint32_t i = 0; i < law.knot_count; ++i) {
      law.knots[i] = {at, stiffness};
      at += 1e-6 + 10.0 * std::pow(random.uniform(), 6.0);
    }
    const double x = 1000.0 * std::pow(random.uniform(), 6.0);
    if (x > 0.0) largest.see(law.force_n(x, 0.0, {}) / (stiffness * x) - 1.0);
  }
  return largest.value();
}

/// Largest change of force in a tick over what the ramp allows, targets of 0 and 100 k in turn, each change
/// coming in the midst of another.
double interrupted_changes(const Effort& effort) {
  constexpr double kRampS = 0.1;
  constexpr double kDepthMm = 2.0;
  constexpr double kStiffest = 40.0;
  rt::TargetBlend blend(rt::linear_target(0.4), kRateHz);
  sim::Random random(2);
  double before = blend.update(kDepthMm, 0.0, {});
  Largest largest;
  const long ticks = effort.ticks(1.0);
  for (long i = 0; i < ticks; ++i) {
    if (random.uniform() < 0.02) {
      blend.set(rt::linear_target(random.uniform() < 0.5 ? 0.0 : kStiffest), kRampS);
    }
    const double now = blend.update(kDepthMm, 0.0, {});
    largest.see((now - before) / (kStiffest * kDepthMm / (kRampS * kRateHz)));
    before = now;
  }
  return largest.value();
}

double blend_ten_hours(const Effort& effort) {
  rt::TargetBlend blend(rt::linear_target(0.7), kRateHz);
  double force = 0.0;
  const long ticks = effort.ticks(10.0);
  for (long i = 0; i < ticks; ++i) force = blend.update(2.0, 0.0, {});
  return std::abs(force - 1.4);
}

double ramp_arrives(const Effort& effort) {
  rt::TargetRamp ramp(1e-4, kRateHz);
  const long ticks = effort.ticks(1.0);
  ramp.set(1e3, 1e-3 * static_cast<double>(ticks));
  for (long i = 0; i <= ticks; ++i) ramp.update();
  return std::abs(ramp.value() - 1e3);
}

double fade_ends(const Effort&) {
  constexpr rt::TickInterval kTick{1.0 / kRateHz, 1.0, 1.0, false};
  rt::ReleaseFade fade;
  fade.update(true, 35.0, kTick);
  int ticks = 0;
  while (fade.update(false, 35.0, kTick) != 0.0 && ticks < 1000) ++ticks;
  return ticks;
}

/// How many-fold errors of force count, targets of 0 … 100 times the structure's stiffness.
double compensated_gain(const Effort&) {
  Largest largest;
  for (double share = 0.0; share < 100.0; share += 0.01) {
    const double at = rt::desired_force_compensated(2.0, share * 3.5, 0.0, 3.5).force_n;
    const double nearby = rt::desired_force_compensated(2.001, share * 3.5, 0.0, 3.5).force_n;
    largest.see((nearby - at) / 0.001);
  }
  return largest.value();
}

/// (3.3) at the tip: f_d - (f_r - k~ x), for what may be asked for.
double compensated_exact(const Effort&) {
  Largest largest;
  for (const double structural : {0.1, 2.537, 3.5, 1e3}) {
    for (double share = 0.0; share <= rt::kMaxCompensableRatio; share += 0.01) {
      for (const double x : {0.0, 0.1, 5.0, 50.0}) {
        const double target = share * structural;
        const rt::DesiredForce d = rt::desired_force_compensated(3.0, target, x, structural);
        const double scale = 3.0 + target * x;
        largest.see((d.force_n - (3.0 - target * d.displacement_mm)) / scale);
      }
    }
  }
  return largest.value();
}

double feasible_at_nothing(const Effort&) {
  double wrong = 0.0;
  for (const double hand : {-1.0, 0.0, std::nan("")}) {
    const rt::FeasibleRange range = rt::feasible_range(0.5, hand, 8.5);
    if (range.min_n_per_mm != 0.0 || !std::isinf(range.max_n_per_mm)) ++wrong;
  }
  if (!std::isinf(rt::feasible_range(0.5, 8.5, 8.5).max_n_per_mm)) ++wrong;
  if (!(rt::feasible_range(0.5, 8.5 + 1e-12, 8.5).max_n_per_mm > 1e11)) ++wrong;
  return wrong;
}

constexpr double kKp = 0.45, kKd = 0.015, kMaxN = 8.5;

/// |z| of the larger root of z² - (1 - Kp - Kd') z - Kd'.
double radius(double kp, double kd) {
  const std::complex<double> half = 0.5 * (1.0 - kp - kd);
  const std::complex<double> root = std::sqrt(half * half + kd);
  return std::max(std::abs(half + root), std::abs(half - root));
}

/// Gains whose simulated course and gains_are_stable() disagree, over a grid that keeps 1 % off the border.
double gains_misjudged(const Effort&) {
  double wrong = 0.0;
  for (double kp = -0.5; kp < 4.5; kp += 0.047) {
    for (double kd = -1.5; kd < 1.5; kd += 0.031) {
      if (std::abs(radius(kp, kd) - 1.0) < 0.01) continue;
      const rt::ControllerParameters parameters{rt::ControlLaw::kClosedLoop, kp, kd};
      rt::ForceController controller(parameters, kRateHz);
      double force = 0.0;
      for (int i = 0; i < 2000 && std::abs(force) < 1e6; ++i) {
        force = controller.update(1.0);
        controller.applied(force);
      }
      const bool settles = std::abs(force - 1.0) < 1e-3;
      if (settles != rt::gains_are_stable(parameters, kRateHz)) ++wrong;
    }
  }
  return wrong;
}

/// Ten hours against the end of the device's force, then nothing is asked for: ticks until the command is
/// below 1 mN.
double saturated_ten_hours(const Effort& effort) {
  rt::ForceController controller({rt::ControlLaw::kClosedLoop, kKp, kKd}, kRateHz);
  const long ticks = effort.ticks(10.0);
  for (long i = 0; i < ticks; ++i) controller.applied(std::min(kMaxN, controller.update(100.0)));
  int after = 0;
  while (after < 10'000) {
    const double force = std::clamp(controller.update(0.0), -kMaxN, kMaxN);
    controller.applied(force);
    ++after;
    if (std::abs(force) < 1e-3) break;
  }
  return after;
}

}  // namespace

ExtremeGroup target_extremes() {
  return {
      "target",
      "Targets and controller",
      {
          {"profile target", "knots 1e-6 … 10 mm apart, 1e-4 … 1e3 N/mm", "force error", "1", 1e-14,
           "∫ k~ dx of a constant", profile_of_a_spring},
          {"target blend", "0 and 100 × k in turn, each change within the last", "largest change a tick",
           "of the ramp's", 1.0 + 1e-12, "weights move linearly", interrupted_changes},
          {"target blend", "ten hours of one target", "drift", "N", 1e-15, "k~ x", blend_ten_hours},
          {"target ramp", "1e-4 to 1e3 N/mm in an hour", "left at its end", "N/mm", 0.0, "arrives",
           ramp_arrives},
          {"release fade", "35 N at release", "ticks to zero", "ticks", 13.0, "12 ms", fade_ends},
          {"desired force", "target 0 … 100 × k_s", "what an error of force counts", "-fold",
           1.0 / (1.0 - rt::kMaxCompensableRatio) * (1.0 + 1e-9), "1/(1 - 0.8)", compensated_gain},
          {"desired force", "k_s 0.1 … 1e3, target to 0.8 k_s, to 50 mm", "error of (3.3) at the tip", "1",
           1e-14, "solved, not iterated", compensated_exact},
          {"feasible range", "hand 0, -1, NaN; hand = device", "wrong answers", "1", 0.0, "(3.8)",
           feasible_at_nothing},
          {"controller", "10 000 pairs of gains, 1 % off the border", "misjudged", "1", 0.0,
           "its poles inside the unit circle", gains_misjudged},
          {"controller", "ten hours at the device's limit, 100 N asked for", "ticks to below 1 mN", "ticks",
           // One tick more for the change of the error.
           std::ceil(std::log(kMaxN / 1e-3) / -std::log(radius(kKp, kKd))) + 1.0, "its own pole: no wind-up",
           saturated_ten_hours},
      }};
}

}  // namespace hapticd::study::extremes
