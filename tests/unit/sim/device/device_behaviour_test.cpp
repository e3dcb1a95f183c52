// The device in motion: latency, converter, amplifier, encoders, structure, friction.

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <string>

#include "hal/sim/base/random.h"
#include "hal/sim/device/device_model.h"
#include "hal/sim/simulation.h"
#include "tests/unit/sim/virtual_rig.h"

namespace hapticd::sim {
namespace {

using test::VirtualRig;

/// No hand to speak of: a spring of 0.02 N/mm around the starting height keeps the device in place.
const HandProgram kLetGo{.kind = HandProgram::Kind::kShake, .force_n = 0.0, .rate_hz = 5.0};
constexpr double kGuideNPerMm = 0.02;

/// A device under test without rig around it, one physics step at a time.
struct Bench {
  Bench(const DeviceModel& model, const HandProgram& program, double tool_mass_kg = 0.0)
      : simulation(model, tool_mass_kg, 1), hand(simulation.prepare(program)) {
    simulation.set_hand(&hand);
  }
  void step(int times = 1) {
    for (int i = 0; i < times; ++i) simulation.step();
  }
  hal::Vector3 encoders_mm() {
    hal::RigSample sample;
    simulation.read_device(sample);
    return sample.tip_position_mm;
  }
  double force_n() const { return simulation.truth().device_force_n.z; }
  double tip_mm() const { return simulation.truth().tip_position_mm.z; }

  Simulation simulation;
  PreparedHand hand;
};

class Device : public testing::TestWithParam<std::string> {
 protected:
  DeviceModel model = *device_preset(GetParam());
};

INSTANTIATE_TEST_SUITE_P(Presets, Device, testing::Values("phantom_1_0", "phantom_1_5_high_force"),
                         [](const auto& tested) { return tested.param; });

TEST_P(Device, ForceComesOneMillisecondAfterTheCommand) {
  Bench bench(model, kLetGo);
  bench.step(7);
  bench.simulation.command({0.0, 0.0, 1.0});
  for (int i = 0; i < 10; ++i) {
    bench.step();
    EXPECT_EQ(bench.force_n(), 0.0) << "step " << i;
  }
  bench.step();
  EXPECT_GT(bench.force_n(), 0.0);
}

TEST_P(Device, CommandsArriveAtEveryLoopRate) {
  for (const double rate_hz : {500.0, 1000.0, 2000.0, 3000.0, 5000.0, 10000.0}) {
    VirtualRig rig({.device = model.name, .object = "none", .rate_hz = rate_hz});
    // A new command at each tick, as the loop writes them: the force follows a ramp of 20 N/s, late by the
    // latency, the amplifier's lag (mean value of the ramp's delay: 1/(2πf)) and at most one tick and a step.
    const double lag_s = model.command_latency_s + 1.0 / (2.0 * std::numbers::pi * model.amplifier_pole_hz);
    while (rig.time_s() < 0.2) {
      const double next_s = rig.time_s() + 1.0 / rate_hz;
      rig.tick({0.0, 0.0, 20.0 * next_s});
    }
    const double late_s = rig.time_s() - rig.truth().device_force_n.z / 20.0;
    const double force_step_s = model.force_step_n() / 20.0;
    EXPECT_GE(late_s, lag_s - 1e-4 - force_step_s) << rate_hz << " Hz";
    EXPECT_LE(late_s, lag_s + 1.0 / rate_hz + 1e-4 + force_step_s) << rate_hz << " Hz";
  }
}

TEST_P(Device, ConverterRoundsToItsSteps) {
  model.amplifier_pole_hz = 1e4;
  const double step_n = 2.0 * model.max_force_n / 4096.0;
  EXPECT_DOUBLE_EQ(model.force_step_n(), step_n);
  Bench bench(model, kLetGo);
  Random random(5);
  for (int i = 0; i < 300; ++i) {
    const double wanted_n = (2.0 * random.uniform() - 1.0) * model.max_force_n;
    bench.simulation.command({0.0, 0.0, wanted_n});
    bench.step(20);
    EXPECT_LE(std::abs(bench.force_n() - wanted_n), 0.5 * step_n + 1e-9);
    EXPECT_NEAR(std::remainder(bench.force_n(), step_n), 0.0, 1e-9);
  }
}

TEST_P(Device, MotorsSaturateOnEachAxis) {
  Bench bench(model, kLetGo);
  bench.simulation.command({1e3, -1e3, 1.01 * model.max_force_n});
  bench.step(300);
  const hal::Vector3 force_n = bench.simulation.truth().device_force_n;
  EXPECT_NEAR(force_n.x, model.max_force_n, 1e-9);
  EXPECT_NEAR(force_n.y, -model.max_force_n, 1e-9);
  EXPECT_NEAR(force_n.z, model.max_force_n, 1e-9);
}

TEST_P(Device, AmplifierLagsByItsPole) {
  model.amplifier_pole_hz = 25.0;
  const double tau_s = 1.0 / (2.0 * std::numbers::pi * model.amplifier_pole_hz);
  const double step_s = Simulation::kStepS;
  Bench bench(model, kLetGo);
  const double wanted_n = 512.0 * model.force_step_n();
  bench.simulation.command({0.0, 0.0, wanted_n});
  bench.step(10);
  double impulse_n_s = 0.0;
  bool rose = false;
  for (int i = 0; i < 1000; ++i) {
    const double from_s = i * step_s, to_s = from_s + step_s;
    bench.step();
    // Mean of 1 - exp(-t/τ) between the two instants.
    const double mean = 1.0 - tau_s / step_s * (std::exp(-from_s / tau_s) - std::exp(-to_s / tau_s));
    ASSERT_NEAR(bench.force_n(), wanted_n * mean, 1e-12 * wanted_n);
    impulse_n_s += bench.force_n() * step_s;
    if (!rose && bench.force_n() > (1.0 - std::exp(-1.0)) * wanted_n) {
      rose = true;
      EXPECT_NEAR(from_s, tau_s, step_s) << "63 % after one time constant";
    }
  }
  EXPECT_NEAR(impulse_n_s, wanted_n * (0.1 - tau_s * (1.0 - std::exp(-0.1 / tau_s))), 1e-9);
}

TEST_P(Device, EncodersCountInWholeSteps) {
  VirtualRig rig({.device = model.name, .object = "none"},
                 {.kind = HandProgram::Kind::kShake, .force_n = 1.0, .rate_hz = 8.0});
  rig.run(2.0, [&] {
    for (const double p_mm :
         {rig.sample().tip_position_mm.x, rig.sample().tip_position_mm.y, rig.sample().tip_position_mm.z}) {
      ASSERT_NEAR(p_mm / model.encoder_resolution_mm, std::round(p_mm / model.encoder_resolution_mm), 1e-9);
    }
    // Free motion bends the structure, by no more than the motors' whole force would.
    ASSERT_NEAR(rig.sample().tip_position_mm.z, rig.truth().tip_position_mm.z,
                0.5 * model.encoder_resolution_mm + 1.1 / model.structural_stiffness_n_per_mm);
  });
}

TEST_P(Device, EncodersMissTheBendingOfTheStructure) {
  model.encoder_resolution_mm = 1e-9;
  for (const double force_n : {2.0, -2.0, 6.0, -6.0}) {
    Bench bench(model, HandProgram{});  // a hand that holds
    bench.step(10'000);
    bench.simulation.command({0.0, 0.0, force_n});
    bench.step(20'000);
    // What of the motors' force friction swallows does not bend the structure.
    const double bending_mm = bench.encoders_mm().z - bench.tip_mm();
    EXPECT_NEAR(bending_mm, bench.force_n() / model.structural_stiffness_n_per_mm,
                1.05 * model.coulomb_friction_n / model.structural_stiffness_n_per_mm);
  }
}

TEST_P(Device, StaysPutBelowItsFrictionAndMovesAboveIt) {
  model.coulomb_friction_n = 0.5;
  model.encoder_resolution_mm = 1e-9;
  for (const double direction : {1.0, -1.0}) {
    Bench bench(model, kLetGo);
    const double start_mm = bench.encoders_mm().z;
    bench.simulation.command({0.0, 0.0, 0.48 * direction});
    bench.step(10'000);
    EXPECT_NEAR(bench.encoders_mm().z, start_mm, 1e-9);
    bench.simulation.command({0.0, 0.0, 0.52 * direction});
    bench.step(50'000);
    const double moved_mm = direction * (bench.encoders_mm().z - start_mm);
    EXPECT_GT(moved_mm, 0.5);
    EXPECT_LE(std::abs(bench.force_n() - direction * kGuideNPerMm * moved_mm), 0.5 + 1e-6)
        << "at rest, spring and motors differ by no more than friction";
  }
}

// Momentum of both sides together: what brakes it besides the guide is friction, the same at every speed.
TEST_P(Device, CoulombFrictionBrakesACoastingDeviceEvenly) {
  model.coulomb_friction_n = 0.3;
  model.viscous_friction_n_s_per_mm = 0.0;
  model.encoder_resolution_mm = 1e-9;
  Bench bench(model, kLetGo, 0.05);
  bench.simulation.command({0.0, 0.0, 5.0});
  bench.step(310);
  bench.simulation.command({});
  bench.step(100);
  const double tip_kg = model.tip_side_mass_kg() + model.sensor_mass_kg + 0.05;
  const auto weighted_kg_mm = [&] {
    return model.motor_side_mass_kg() * bench.encoders_mm().z + tip_kg * bench.tip_mm();
  };
  const auto momentum_n_s = [&] {  // over one step: that of its middle
    const double before_kg_mm = weighted_kg_mm();
    bench.step();
    return 1e-3 * (weighted_kg_mm() - before_kg_mm) / Simulation::kStepS;
  };
  double last_n_s = momentum_n_s();
  double last_mm = bench.tip_mm();
  for (int i = 0; i < 400; ++i) {
    const double n_s = momentum_n_s();
    // Between the middles: the guide's spring at the tip's place then, its damper at the tip's speed.
    const double tip_mm = bench.tip_mm();
    const double guide_n = kGuideNPerMm * (last_mm - 10.0) + 2e-4 * (tip_mm - last_mm) / Simulation::kStepS;
    ASSERT_NEAR((last_n_s - n_s) / Simulation::kStepS - guide_n, 0.3, 0.003);
    last_n_s = n_s;
    last_mm = tip_mm;
  }
}

TEST_P(Device, StructureRingsAtItsModeWithItsDamping) {
  model.sensor_mass_kg = 0.0;
  model.viscous_friction_n_s_per_mm = 0.0;
  const Bench bench(model,
                    {.kind = HandProgram::Kind::kWeight, .mass_g = 1e-9});  // bare: no spring, no damper
  AxisState s{0.0, 0.0, 1.0, 0.0};
  // Extremes of the stretch, half a cycle apart.
  std::vector<double> peak_mm, peak_s;
  double before_mm = 1.0, here_mm = 1.0;
  for (int i = 1; peak_mm.size() < 8; ++i) {
    s = bench.hand.along.advance(s, 0.0, 0.0);
    const double after_mm = s.tip_mm - s.motor_mm;
    if (i > 1 && (here_mm - before_mm) * (after_mm - here_mm) <= 0.0) {
      peak_mm.push_back(std::abs(here_mm));
      peak_s.push_back((i - 1) * Simulation::kStepS);
    }
    before_mm = here_mm;
    here_mm = after_mm;
  }
  const double decrement = std::log(peak_mm.front() / peak_mm.back()) / 7.0;  // per half cycle
  const double ratio = decrement / std::hypot(std::numbers::pi, decrement);
  EXPECT_NEAR(ratio, model.structural_damping, 0.02 * model.structural_damping);
  const double mode_hz = 3.5 / (peak_s.back() - peak_s.front()) / std::sqrt(1.0 - ratio * ratio);
  EXPECT_NEAR(mode_hz, model.structural_mode_hz, 0.01 * model.structural_mode_hz);
}

TEST_P(Device, ShakenFreelyItIsAForcedOscillator) {
  model.coulomb_friction_n = 0.0;
  const double force_n = 1.0, rate_hz = 5.0, tool_kg = 0.02;
  Bench bench(model, {.kind = HandProgram::Kind::kShake, .force_n = force_n, .rate_hz = rate_hz}, tool_kg);
  bench.step(120'000);  // the start has died away
  const double omega = 2.0 * std::numbers::pi * rate_hz;
  double in_phase = 0.0, in_quadrature = 0.0;
  constexpr int kCycles = 5;
  const int steps = static_cast<int>(std::lround(kCycles / rate_hz / Simulation::kStepS));
  for (int i = 0; i < steps; ++i) {
    bench.step();
    const double t_s = 1e-9 * static_cast<double>(bench.simulation.time_ns());
    in_phase += 2.0 * (bench.tip_mm() - 10.0) * std::sin(omega * t_s) / steps;
    in_quadrature += 2.0 * (bench.tip_mm() - 10.0) * std::cos(omega * t_s) / steps;
  }
  const double mass_kg = model.apparent_mass_kg + model.sensor_mass_kg + tool_kg;
  const double reactive = kGuideNPerMm - 1e-3 * mass_kg * omega * omega;
  const double resistive = omega * (2e-4 + model.viscous_friction_n_s_per_mm);
  const double magnitude = reactive * reactive + resistive * resistive;
  // Bending adds (ω / mode)² times the share of mass beyond the structure: less than 1 %.
  EXPECT_NEAR(in_phase, force_n * reactive / magnitude, 0.01 * std::abs(force_n * reactive / magnitude));
  EXPECT_NEAR(in_quadrature, -force_n * resistive / magnitude, 0.03 * force_n * resistive / magnitude);
}

}  // namespace
}  // namespace hapticd::sim
