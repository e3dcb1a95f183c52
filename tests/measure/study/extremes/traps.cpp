// Published equations that fail when taken as printed, next to the forms used here.

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "hal/sim/base/random.h"
#include "hal/sim/device/axis_dynamics.h"
#include "rt/control/force_controller.h"
#include "rt/deformation/fused_displacement.h"
#include "rt/deformation/hunt_crossley.h"
#include "rt/friction/dahl.h"
#include "rt/signal/structural_deflection.h"
#include "rt/target/desired_force.h"
#include "tests/measure/study/common/parts.h"

namespace hapticd::study {

namespace {

constexpr double kRateHz = 1000.0;

struct Trap {
  const char* name;
  const char* fails;     ///< what fails, from which value on
  const char* predicts;  ///< the closed form that says so
  const char* measured;
  const char* unit;
  double limit;  ///< of stability, or of what would be right
  double published, here;
};

/// How a deviation grows from one tick to the next: the largest pole, once the others have died away.
double growth(const std::vector<double>& course, std::size_t tick) {
  return std::abs(course[tick] / course[tick - 1]);
}

/// Growth of the deviation from 1 N that is asked for from the start; K_d per sample, which in ms is at 1
/// kHz.
double step_growth(double kp, double kd_per_sample, std::size_t tick) {
  rt::ForceController controller({rt::ControlLaw::kClosedLoop, kp, kd_per_sample}, kRateHz);
  std::vector<double> deviation;
  while (deviation.size() <= tick) {
    const double force = controller.update(1.0);
    controller.applied(force);
    deviation.push_back(force - 1.0);
  }
  return growth(deviation, tick);
}

/// Growth of the command's change behind (3.3), 5 N of reaction at 1 mm, the encoders held.
template <class Desired>
double deflection_growth(const Desired& desired) {
  rt::ForceController controller({rt::ControlLaw::kClosedLoop, 1.05, 0.0}, kRateHz);
  std::vector<double> change;
  while (change.size() < 4) {
    const double last = controller.device_force_n();
    const double force = controller.update(desired(last));
    controller.applied(force);
    change.push_back(force - last);
  }
  return growth(change, 3);
}

constexpr double kStructural = 2.537;  // N/mm, high-force device (D§4.6)

Trap deflection_loop() {
  constexpr double kTarget = 3.0;
  return {"(4.25) closes an algebraic loop",
          "unstable beyond k~ = k_s (2/Kp - 1) = 2.30 N/mm",
          "pole 1 - Kp (1 + k~/k_s); solved for f~_d at the present tick, 1 - Kp",
          "largest pole |z| at k~ = 3 N/mm",
          "1",
          1.0,
          deflection_growth([](double last_n) { return 5.0 - kTarget * (1.0 + last_n / kStructural); }),
          deflection_growth(
              [](double) { return rt::desired_force_compensated(5.0, kTarget, 1.0, kStructural).force_n; })};
}

/// A device against a hand that holds, at rest; the truth is the simulator's.
Trap deflection_sign() {
  constexpr double kForceN = 4.0;
  const sim::AxisDynamics dynamics({0.075, 0.06, kStructural, 5e-3, 1e-3, 1.0, 0.02}, 1e-3);
  sim::AxisState state;
  rt::StructuralDeflection deflection(kStructural, 10.0, kRateHz);
  double bent_mm = 0.0;
  for (int i = 0; i < 5000; ++i) {
    state = dynamics.advance(state, kForceN, 0.0);
    bent_mm = deflection.update({kForceN, 0.0, 0.0}).x;
  }
  return {"sign of (4.25)",
          "with + the error of the tip is twice that of no compensation at all",
          "p = p_s - f_d/k_s by (4.26); + leaves 2 f_d/k_s",
          "error of the tip at 4 N",
          "mm",
          0.01,
          std::abs(state.motor_mm + kForceN / kStructural - state.tip_mm),
          std::abs(state.motor_mm - bent_mm - state.tip_mm)};
}

/// (4.14): the present friction and the way since the turn together.
Trap dahl_counting() {
  constexpr double kPreslidingMm = 0.3, kStepMm = 0.03;
  Trap trap{"(4.14) counts the way twice",
            "friction turns over in a fraction of the presliding way, and the more samples, the faster",
            "z = 1 - 2 exp(-x/δ) after a turn",
            "largest error of friction, of f_c",
            "1",
            1e-12,
            0.0,
            0.0};
  double published = -1.0, here = -1.0;
  for (int i = 1; i <= 50; ++i) {
    const double path_mm = kStepMm * i;
    const double exact = 1.0 - 2.0 * std::exp(-path_mm / kPreslidingMm);
    published = 1.0 + (published - 1.0) * std::exp(-path_mm / kPreslidingMm);
    here = rt::dahl_step(here, kStepMm, kPreslidingMm);
    trap.published = std::max(trap.published, std::abs(published - exact));
    trap.here = std::max(trap.here, std::abs(here - exact));
  }
  return trap;
}

Trap dahl_euler() {
  constexpr double kRatio = 3.0;
  double euler = -1.0, exact = -1.0, largest_euler = 1.0, largest_exact = 1.0;
  for (int i = 0; i < 50; ++i) {
    euler += kRatio * (1.0 - euler);
    exact = rt::dahl_step(exact, kRatio, 1.0);
    largest_euler = std::max(largest_euler, std::abs(euler));
    largest_exact = std::max(largest_exact, std::abs(exact));
  }
  return {"(4.12) in explicit steps at light touch",
          "diverges where σ|Δx|/f_c > 2, that is at f_c below σ|Δx|/2; at f_c = 0 it divides by zero",
          "factor 1 - σ|Δx|/f_c a step",
          "|f/f_c| after 50 steps at σ|Δx|/f_c = 3",
          "1",
          1.0,
          largest_euler,
          largest_exact};
}

/// (6.3) with ḋ_t(t) = ḋ_t(t - 1), as D§6.3 has it, in a press of 10 mm in 0.1 s; (6.2) solved decays.
Trap tumour() {
  constexpr double kPeriodS = 1e-3, kStiffness = 0.45, kDamping = 0.004;  // N/mm, N·s/mm: D§6.3
  constexpr double kLagS = kDamping / kStiffness;
  const auto pressed_mm = [](int tick) { return 5.0 * (1.0 - std::cos(10.0 * M_PI * kPeriodS * tick)); };
  std::vector<double> d_mm{0.0};
  double rate = 0.0;
  for (int i = 1; i <= 12; ++i) {
    const double rate_of_tip = (pressed_mm(i) - pressed_mm(i - 1)) / kPeriodS;
    d_mm.push_back(0.5 * pressed_mm(i) + 0.5 * kLagS * rate_of_tip - kLagS * rate);
    rate = (d_mm[d_mm.size() - 1] - d_mm[d_mm.size() - 2]) / kPeriodS;
  }
  return {"(6.3), the tumour",
          "diverges from B/(K T) = 1/2 on; the published constants give 8.9",
          "z² + r z - r = 0, r = B/(K T): a pole at -1 for r = 1/2; (6.2) solves to d/2 + e^(-Kt/B)",
          "pole |z| after 12 ms",
          "1",
          1.0,
          growth(d_mm, 12),
          std::exp(-kPeriodS / kLagS)};
}

/// Newtons of k~ x per newton of jitter at 60 mN, the tip sliding at 100 mm/s.
Trap inverse_noise() {
  constexpr rt::HuntCrossleyParameters kSponge{0.0059, 0.0, 2.1};  // N/mm^m: 0.18 N/mm at 4 N (D§4.7)
  constexpr double kTarget = 0.8, kForceN = 0.06;
  constexpr double kJitterN = 1e-3;  // not clipped at zero, so that what is measured is the gain
  sim::Random random(1);
  rt::FusedDisplacement fused(0.05, 10.0 * kJitterN, kRateHz);
  fused.begin(rt::hunt_crossley_displacement(kSponge, kForceN, 0.0).displacement_mm, 0.1);
  struct Sums {
    double n = 0.0, sum = 0.0, squares = 0.0;
    void add(double x) {
      n += 1.0;
      sum += x;
      squares += x * x;
    }
    double gain() const { return kTarget / kJitterN * std::sqrt(squares / n - (sum / n) * (sum / n)); }
  } inverse_mm, fused_mm;
  for (int i = 0; i < 6000; ++i) {
    const rt::LawEstimate law =
        rt::hunt_crossley_displacement(kSponge, kForceN + kJitterN * random.normal(), 0.0);
    fused.update(0.0, 0.1, law);
    if (i < 1000) continue;
    inverse_mm.add(law.displacement_mm);
    fused_mm.add(fused.displacement_mm());
  }
  return {
      "noise gain of (4.23)",
      "10 mN of jitter become 0.18 N of target force at 60 mN: the instability of D§4.6.2 at small forces",
      "∂(k~ x)/∂f = k~ x/(m f)",
      "noise of k~ x over noise of f at 60 mN, k~ 0.8 N/mm",
      "1",
      1.0,
      inverse_mm.gain(),
      fused_mm.gain()};
}

}  // namespace

void run_traps(StudyContext& context) {
  const std::vector<Trap> traps{
      {"unit of K_d (3.6)", "K_d of 0.015 taken per second, as df/dt has it, is unstable at 1 kHz",
       "z² - (1 - Kp - Kd') z - Kd' = 0, stable for |Kd'| < 1, Kp + 2 Kd' < 2", "largest pole |z|", "1", 1.0,
       step_growth(0.45, 15.0, 11), step_growth(0.45, 0.015, 11)},
      {"(3.6) without K_d", "f_d is last tick's command: it oscillates without end from Kp = 2 on",
       "f_c(k) = (1 - Kp) f_c(k-1) + Kp f~_d(k): pole 1 - Kp", "pole |z|, Kp 2.1 and 0.45", "1", 1.0,
       step_growth(2.1, 0.0, 4), step_growth(0.45, 0.0, 4)},
      deflection_loop(),
      deflection_sign(),
      dahl_counting(),
      dahl_euler(),
      tumour(),
      inverse_noise()};
  report::MarkdownTable table(
      {"equation", "what fails", "predicted by", "measured", "published", "here", "limit", "unit"});
  for (const Trap& trap : traps) {
    for (const auto& [form, value] : {std::pair{"published", trap.published}, {"here", trap.here}}) {
      report::Figure figure{"trap", {{"trap", trap.name}, {"form", form}}, value, trap.unit, trap.limit};
      figure.source = trap.predicts;
      context.report.add(figure);
    }
    table.add_row({trap.name, trap.fails, trap.predicts, trap.measured, report::significant(trap.published),
                   report::significant(trap.here), report::significant(trap.limit), trap.unit});
  }
  context.report.add_table("traps", "Equations that fail as printed, next to what hapticd does", table);
}

}  // namespace hapticd::study
