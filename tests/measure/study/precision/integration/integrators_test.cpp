// The candidates next to the simulator's scheme: closed forms, orders, and that all solve the same equations.

#include <gtest/gtest.h>

#include <cmath>

#include "tests/measure/study/precision/integration/order_of_convergence.h"
#include "tests/measure/study/precision/integration/press_integrators.h"

namespace hapticd::study {
namespace {

using enum IntegrationMethod;

TEST(OrderOfConvergence, IsTheExponentOfAPowerLaw) {
  const std::vector<double> steps{1.0, 0.5, 0.2, 0.1};
  std::vector<double> errors;
  for (const double h : steps) errors.push_back(7.0 * h * h);
  EXPECT_NEAR(*order_of_convergence(steps, errors, 0.0), 2.0, 1e-12);
}

TEST(OrderOfConvergence, LeavesOutWhatTheReferenceCannotTell) {
  EXPECT_NEAR(*order_of_convergence({1.0, 0.1, 0.01}, {1.0, 0.1, 0.05}, 0.06), 1.0, 1e-12);
  EXPECT_FALSE(order_of_convergence({1.0, 0.1}, {1.0, 0.1}, 0.5).has_value());
  EXPECT_NEAR(*order_of_convergence({1.0, 0.1, 0.01}, {NAN, 0.1, 0.01}, 0.0), 1.0, 1e-12);
}

/// A tip on the hand's spring alone, 1 kg at 1 N/mm without damping, the motor side hardly coupled.
PressPlant oscillator() {
  PressPlant plant;
  plant.axis = {.motor_mass_kg = 1.0, .tip_mass_kg = 1.0, .hand_stiffness_n_per_mm = 1.0};
  plant.has_object = false;
  return plant;
}

double oscillator_error(IntegrationMethod method, double step_s) {
  const double omega = std::sqrt(1000.0);
  PressState start;
  start.tip_mm = 1.0;
  const auto run = make_integrator(method, oscillator(), start, step_s);
  const int steps = static_cast<int>(std::lround(0.2 / step_s));
  for (int i = 0; i < steps; ++i) run->step(i * step_s, 0.0);
  return std::hypot(run->tip_mm() - std::cos(omega * 0.2),
                    run->tip_mm_per_s() / omega + std::sin(omega * 0.2));
}

TEST(PressIntegrators, HaveTheirOrderOnAnOscillator) {
  const auto order = [](IntegrationMethod method) {
    return std::log2(oscillator_error(method, 1e-3) / oscillator_error(method, 5e-4));
  };
  EXPECT_NEAR(order(kExplicitEuler), 1.0, 0.2);
  EXPECT_NEAR(order(kRungeKutta4), 4.0, 0.2);
  EXPECT_LT(oscillator_error(kShipped, 1e-3), 1e-10);
}

TEST(PressIntegrators, ExplicitEulerGainsEnergy) {
  // Per step its amplitude grows by sqrt(1 + ω²h²).
  constexpr double kH = 1e-3;
  constexpr int kSteps = 200;
  PressState start;
  start.tip_mm = 1.0;
  const auto run = make_integrator(kExplicitEuler, oscillator(), start, kH);
  for (int i = 0; i < kSteps; ++i) run->step(i * kH, 0.0);
  EXPECT_NEAR(std::hypot(run->tip_mm(), run->tip_mm_per_s() / std::sqrt(1000.0)),
              std::pow(1.0 + 1000.0 * kH * kH, 0.5 * kSteps), 1e-9);
}

/// A hand leans on a linear spring with a relaxation branch and viscosity, dry friction in the device.
PressPlant leaning() {
  PressPlant plant;
  plant.axis = {.motor_mass_kg = 0.05,
                .tip_mass_kg = 0.07,
                .structural_stiffness_n_per_mm = 3.5,
                .structural_damping_n_s_per_mm = 4e-4,
                .motor_viscosity_n_s_per_mm = 5e-6,
                .hand_stiffness_n_per_mm = 0.5,
                .hand_damping_n_s_per_mm = 4e-3};
  plant.material.stiffness_at_4n_n_per_mm = 2.0;
  plant.material.branches[0] = {0.2, 0.02};
  plant.material.skin_viscosity_n_s_per_mm = 1e-3;
  plant.coulomb_n = 0.06;
  plant.amplifier_pole_hz = 300.0;
  plant.hand_path = sim::MinimumJerk({-5.0, 0.0, 0.0}, {8.0, 0.0, 0.0}, 0.2);
  return plant;
}

TEST(PressIntegrators, AllConvergeToTheSamePress) {
  PressState start;
  start.motor_mm = start.tip_mm = -5.0;
  const auto end = [&](IntegrationMethod method, double step_s) {
    const auto run = make_integrator(method, leaning(), start, step_s);
    const int steps = static_cast<int>(std::lround(0.25 / step_s));
    for (int i = 0; i < steps; ++i) run->step(i * step_s, -0.5);
    return std::pair{run->tip_mm(), run->contact_n()};
  };
  const auto reference = end(kRungeKutta4, 1e-6);
  EXPECT_GT(reference.first, 0.5);
  for (const IntegrationMethod method : integration_methods()) {
    const auto found = end(method, 2e-6);
    EXPECT_NEAR(found.first, reference.first, 1e-3) << name_of(method);
    EXPECT_NEAR(found.second, reference.second, 2e-3) << name_of(method);
  }
}

TEST(PressIntegrators, RestWhereTheForcesBalance) {
  // Device off: k_h (x_h - x) = K x once the branch has relaxed; K is what makes 4 N at 0.5 N/s a secant.
  PressPlant plant = leaning();
  plant.coulomb_n = 0.0;
  plant.material = {};
  plant.material.stiffness_at_4n_n_per_mm = 2.0;
  PressState start;
  start.motor_mm = start.tip_mm = -5.0;
  for (const IntegrationMethod method : {kShipped, kRungeKutta4}) {
    const auto run = make_integrator(method, plant, start, 1e-4);
    for (int i = 0; i < 20'000; ++i) run->step(i * 1e-4, 0.0);
    EXPECT_NEAR(run->tip_mm(), 0.5 * 8.0 / 2.5, 1e-6) << name_of(method);
    EXPECT_NEAR(run->contact_n(), 2.0 * 0.5 * 8.0 / 2.5, 1e-6) << name_of(method);
  }
}

}  // namespace
}  // namespace hapticd::study
