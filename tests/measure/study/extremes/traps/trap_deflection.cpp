// Traps of (4.25): the algebraic loop and the sign.

#include <cmath>
#include <vector>

#include "hal/sim/device/axis_dynamics.h"
#include "rt/control/force_controller.h"
#include "rt/signal/structural_deflection.h"
#include "rt/target/desired_force.h"
#include "tests/measure/study/extremes/spectral_radius.h"
#include "tests/measure/study/extremes/traps/trap.h"

namespace hapticd::study::extremes {

namespace {

constexpr double kRateHz = 1000.0;
constexpr double kStructural = 2.537;  // N/mm, high-force device (D§4.6)
constexpr double kKp = 1.05;
constexpr double kReactionN = 5.0;  // at 1 mm; more than any target here asks for, so that something moves

/// Controller behind (3.3) with the encoders held: deviation of the command from where it rests.
template <class Desired>
double radius_of(const Desired& desired) {
  rt::ForceController controller({rt::ControlLaw::kClosedLoop, kKp, 0.0}, kRateHz);
  std::vector<double> command;
  for (int i = 0; i < 24; ++i) {
    const double force = controller.update(desired(controller.device_force_n()));
    controller.applied(force);
    command.push_back(force);
  }
  std::vector<double> change;  // the difference of two ticks has the same poles and rests at zero
  for (std::size_t i = 1; i < command.size(); ++i) change.push_back(command[i] - command[i - 1]);
  return spectral_radius(change);
}

double radius_published(double target) {
  // x = x_s + f_c(k-1)/k_s in (3.3), all of last tick's command at once.
  return radius_of([=](double last_n) { return kReactionN - target * (1.0 + last_n / kStructural); });
}
double radius_here(double target) {
  return radius_of(
      [=](double) { return rt::desired_force_compensated(kReactionN, target, 1.0, kStructural).force_n; });
}

}  // namespace

Trap deflection_loop_trap() {
  Trap trap;
  trap.name = "4 (4.25) closes an algebraic loop";
  trap.fails = "unstable beyond k~ = k_s (2/Kp - 1) = 2.30 N/mm";
  trap.predicts = "pole 1 - Kp (1 + k~/k_s); solved for f~_d at the present tick, 1 - Kp";
  trap.quantity = "largest pole |z| at k~ = 3 N/mm";
  trap.unit = "1";
  trap.limit = 1.0;
  trap.plot_name = "deflection_loop";
  trap.plot = small_plot("(4.25) in (3.3), Kp 1.05, k_s 2.537 N/mm", {"target stiffness", "N/mm"},
                         {"largest pole |z|", "1"});
  report::PlotSeries bad = published("last tick's f_c"), good = ours("solved");
  for (double target = 0.1; target <= 4.0; target += 0.1) {
    bad.add(target, radius_published(target));
    good.add(target, radius_here(target));
  }
  trap.plot.series = {bad, good};
  trap.plot.references = {{report::PlotReference::Axis::kY, 1.0, ""},
                          {report::PlotReference::Axis::kX, kStructural * (2.0 / kKp - 1.0), "2.30"}};
  trap.forms = {{"published", radius_published(3.0)}, {"here", radius_here(3.0)}};
  return trap;
}

Trap deflection_sign_trap() {
  Trap trap;
  trap.name = "5 sign of (4.25)";
  trap.fails = "with + the error of the tip is twice that of no compensation at all";
  trap.predicts = "p = p_s - f_d/k_s by (4.26); + leaves 2 f_d/k_s";
  trap.quantity = "error of the tip at 4 N";
  trap.unit = "mm";
  trap.limit = 0.01;
  trap.plot_name = "deflection_sign";
  trap.plot = small_plot("Where the tip is, against the two-mass simulator, k_s 2.537 N/mm",
                         {"force of the device", "N"}, {"error of the tip", "mm"});
  report::PlotSeries plus = published("p_s + f_d/k_s"), none{"encoders alone"}, minus = ours("p_s - f_d/k_s");
  none.color = cli::palette(7);
  for (double force = -6.0; force <= 6.0; force += 1.0) {
    // Device against a hand that holds: truth from the simulator, at rest.
    const sim::AxisDynamics dynamics({0.075, 0.06, kStructural, 5e-3, 1e-3, 1.0, 0.02}, 1e-3);
    sim::AxisState state;
    rt::StructuralDeflection deflection(kStructural, 10.0, kRateHz);
    double bent = 0.0;
    for (int i = 0; i < 5000; ++i) {
      state = dynamics.advance(state, force, 0.0);
      bent = deflection.update({force, 0.0, 0.0}).x;
    }
    const double error_plus = state.motor_mm + force / kStructural - state.tip_mm;
    const double error_none = state.motor_mm - state.tip_mm;
    const double error_minus = state.motor_mm - bent - state.tip_mm;
    plus.add(force, error_plus);
    none.add(force, error_none);
    minus.add(force, error_minus);
    if (force == 4.0) {
      trap.forms = {{"published, +", std::abs(error_plus)},
                    {"encoders alone", std::abs(error_none)},
                    {"here, -", std::abs(error_minus)}};
    }
  }
  trap.plot.series = {plus, none, minus};
  return trap;
}

}  // namespace hapticd::study::extremes
