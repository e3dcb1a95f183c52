#include <algorithm>
#include <cmath>
#include <limits>

#include "hal/sim/base/random.h"
#include "hal/sim/device/axis_dynamics.h"
#include "hal/sim/device/device_model.h"
#include "hal/sim/object/friction.h"
#include "hal/sim/object/material.h"
#include "hal/sim/object/object_model.h"
#include "hal/sim/sensor/nano17.h"
#include "hal/sim/simulated_rig.h"
#include "rt/signal/vector.h"
#include "tests/measure/study/common/hands.h"
#include "tests/measure/study/common/virtual_run.h"
#include "tests/measure/study/extremes/extreme.h"
#include "tests/measure/study/extremes/fed_scene.h"

namespace hapticd::study::extremes {

namespace {

constexpr double kStepS = 1e-4;
constexpr double kEpsilon = std::numeric_limits<double>::epsilon();

// -- device and hand

/// One step of a millisecond against ten, over structures of 1e-4 … 1e3 N/mm; velocities count in those of
/// the stiffest, 3.5 m/s.
double axis_split(const Effort&) {
  Largest largest;
  for (const double stiffness : {1e-4, 1.0, 3.5, 1e3}) {
    for (const double damping : {0.0, 4e-4, 0.05}) {
      const sim::AxisParameters p{0.06, 0.055, stiffness, damping, 2e-5, 0.5, 4e-3};
      const sim::AxisDynamics coarse(p, 1e-3), fine(p, kStepS);
      sim::AxisState many{1.0, -30.0, 0.4, 120.0};
      const sim::AxisState one = coarse.advance(many, 2.0, -1.5);
      for (int i = 0; i < 10; ++i) many = fine.advance(many, 2.0, -1.5);
      largest.see((one.motor_mm - many.motor_mm) / 1.0);
      largest.see((one.tip_mm - many.tip_mm) / 1.0);
      largest.see((one.motor_mm_per_s - many.motor_mm_per_s) / 3500.0);
      largest.see((one.tip_mm_per_s - many.tip_mm_per_s) / 3500.0);
    }
  }
  return largest.value();
}

/// An undamped structure left to swing for ten hours, a step a millisecond.
double axis_energy(const Effort& effort) {
  const sim::AxisParameters p{0.06, 0.055, 3.5, 0.0, 0.0, 0.5, 0.0};
  const sim::AxisDynamics dynamics(p, 1e-3);
  sim::AxisState s{1.0, 0.0, 0.4, 0.0};
  const auto energy = [&] {
    const auto kinetic = [](double kg, double v) { return 0.5e-3 * kg * v * v; };
    const double stretch = s.tip_mm - s.motor_mm;
    return kinetic(p.motor_mass_kg, s.motor_mm_per_s) + kinetic(p.tip_mass_kg, s.tip_mm_per_s) +
           0.5 * p.structural_stiffness_n_per_mm * stretch * stretch +
           0.5 * p.hand_stiffness_n_per_mm * s.tip_mm * s.tip_mm;
  };
  const double first = energy();
  const long ticks = effort.ticks(10.0);
  for (long i = 0; i < ticks; ++i) s = dynamics.advance(s, 0.0, 0.0);
  return std::abs(energy() / first - 1.0);
}

// -- matter

template <class Visit>
void for_all_matter(const Visit& visit) {
  for (const double stiffness : {1e-4, 1e-2, 1.0, 1e3}) {
    for (const char* name : {"sponge_block", "rubber_ball"}) {
      sim::MaterialParameters p = sim::object_preset(name)->material;
      const double scale = stiffness / p.stiffness_at_4n_n_per_mm;
      p.stiffness_at_4n_n_per_mm = stiffness;
      p.skin_stiffness_n_per_mm *= scale;
      p.skin_viscosity_n_s_per_mm *= scale;
      visit(p);
    }
  }
}

/// Jumps no hand could make, tips of any compliance: what the implicit step leaves of its equation.
double material_solved(const Effort& effort) {
  Largest largest;
  for_all_matter([&](const sim::MaterialParameters& p) {
    sim::Random random(1);
    for (const double compliance : {0.0, 1e-4, 1.0, 1e3}) {
      sim::Material material(p, kStepS);
      const double deepest = 8.0 / p.stiffness_at_4n_n_per_mm;
      const int steps = effort.quick ? 300 : 10'000;
      for (int i = 0; i < steps; ++i) {
        const double free = -5.0 + (5.0 + deepest) * random.uniform();
        const sim::Material::Step step = material.advance(free, compliance);
        const double scale = std::abs(free) + compliance * step.mean_force_n + 1.0;
        largest.see((step.depth_mm - (free - compliance * step.mean_force_n)) / scale);
        if (step.force_n < 0.0 || step.mean_force_n < 0.0) largest.see(1.0);  // it pulls
      }
    }
  });
  return largest.value();
}

double material_held(const Effort& effort) {
  Largest largest;
  for_all_matter([&](const sim::MaterialParameters& p) {
    sim::Material material(p, 1e-3);
    const double depth = 2.0 / p.stiffness_at_4n_n_per_mm;
    double force = 0.0;
    const long ticks = std::max(120'000L, effort.ticks(1.0));  // 40 of the slowest relaxation times at least
    for (long i = 0; i < ticks; ++i) force = material.advance(depth, 0.0).force_n;
    largest.see(force / material.elastic_force_n(depth) - 1.0);
  });
  return largest.value();
}

// -- friction

sim::FrictionParameters rough() {
  sim::FrictionParameters p;
  p.kinetic = 0.6;
  p.static_ratio = 2.2;
  p.ripple_share = 0.3;
  return p;
}

/// Loads 1e-12 … 35 N, slides of 1e-9 … 1e3 mm a step, any direction: force over what friction can hold.
double friction_level(const Effort& effort) {
  sim::Friction friction(rough(), kStepS);
  sim::Random random(2);
  return largest_of(effort.ticks(0.3), [&](long i) {
    const double normal = std::pow(10.0, 13.5 * random.uniform() - 12.0);
    const double way = std::pow(10.0, 12.0 * random.uniform() - 9.0);
    const double angle = 6.283 * random.uniform();
    const hal::Vector3 force = friction.advance({way * std::cos(angle), way * std::sin(angle), 0.0},
                                                i % 2 == 0 ? 0.0 : 1e-5, normal);
    // Bristles and their damping: the level, and what damping adds while they turn over in one step.
    const double level = rough().kinetic * rough().static_ratio * (1.0 + rough().ripple_share);
    const double most = level * (1.0 + 2.0 * rough().bristle_damping_s / kStepS);
    return rt::norm(force) / (most * normal);
  });
}

/// A pull back and forth about a quarter of breakaway: where the tip is at the same phase, early and late.
double friction_vibrated(const Effort& effort) {
  sim::Friction friction(sim::FrictionParameters{}, kStepS);
  constexpr double kNormalN = 2.0;
  constexpr double kComplianceMmPerN = 8e-5;  // 60 g over a step
  constexpr long kCycle = 120;
  double x = 0.0, early = 0.0;
  const long cycles = effort.ticks(10.0) / kCycle;  // an hour of steps
  for (long cycle = 0; cycle < cycles; ++cycle) {
    for (long i = 0; i < kCycle; ++i) {
      const double pull = 0.2 + 0.1 * std::sin(2.0 * 3.14159265358979 * static_cast<double>(i) / kCycle);
      const double free = kComplianceMmPerN * pull;
      x += free + kComplianceMmPerN * friction.advance({free, 0.0, 0.0}, kComplianceMmPerN, kNormalN).x;
    }
    if (cycle == cycles / 10) early = x;
  }
  return std::abs(x - early);
}

// -- sensor

double sensor_nan(const Effort&) {
  sim::Nano17 sensor(0.009, 1);
  hal::RigSample sample;
  sensor.measure({std::nan(""), 0.0, 0.0});
  sensor.read(sample);
  if (!std::isfinite(sample.sensor_force_n.x) || (sample.status & hal::sample_status::kForceSaturated) == 0)
    return 1e6;
  for (int tick = 0; tick < 100; ++tick) {
    for (int i = 0; i < 10; ++i) sensor.measure({});
    hal::RigSample next;
    sensor.read(next);
    if (next.status == 0 && std::abs(next.sensor_force_n.x) < 0.1) return tick;
  }
  return 100.0;
}

double sensor_saturated(const Effort&) {
  sim::Nano17 sensor(0.009, 1);
  for (int i = 0; i < 10; ++i) sensor.measure({1e6, -1e6, 1e6});
  hal::RigSample sample;
  sensor.read(sample);
  if ((sample.status & hal::sample_status::kForceSaturated) == 0) return 1e6;
  return std::max({std::abs(sample.sensor_force_n.x) - 25.0, std::abs(sample.sensor_force_n.y) - 25.0,
                   std::abs(sample.sensor_force_n.z) - 35.0, 0.0});
}

double sensor_mean(const Effort& effort) {
  sim::Nano17 sensor(0.009, 1);
  double sum = 0.0;
  const long ticks = effort.ticks(0.2);
  for (long i = 0; i < ticks; ++i) {
    for (int n = 0; n < 10; ++n) sensor.measure({0.0, 0.0, 1.2345});
    hal::RigSample sample;
    sensor.read(sample);
    sum += sample.sensor_force_n.z;
  }
  // In standard errors of the mean of that many samples.
  const double error = sum / static_cast<double>(ticks) - 1.2345;
  return std::abs(error) / (6.3e-3 / std::sqrt(10.0 * static_cast<double>(ticks)));
}

// -- the whole rig

sim::SimulationConfig rig_of(const char* object) {
  sim::SimulationConfig rig;
  rig.device = "phantom_1_5_high_force";
  rig.object = object;
  return rig;
}

rt::SceneSpec with_target(double target) {
  rt::SceneSpec scene = tap_scene();
  scene.structural_compensation = false;  // else targets end at 0.8 k_s
  scene.target = rt::linear_target(target);
  return scene;
}

/// What is largest of a run in which everything may be asked for: position [m], forces [10 N].
double rig_bounded(const char* object, double target, double minutes, const Effort& effort) {
  VirtualRun run(rig_of(object), with_target(target));
  run.set_hand(tapping(400.0));
  Largest largest;
  const long ticks = effort.ticks(minutes / 60.0);
  for (long i = 0; i < ticks; ++i) {
    run.step();
    largest.see(1e-3 * rt::norm(run.truth().tip_position_mm));
    largest.see(1e-2 * rt::norm(run.truth().reaction_force_n));
    largest.see(1e-2 * rt::norm(run.sample().sensor_force_n));
    if (run.record().guard_state == rt::GuardState::kLatched) break;
  }
  return largest.value();
}

double rig_repeats(const Effort&) {
  VirtualRun a(rig_of("rubber_ball"), with_target(0.3)), b(rig_of("rubber_ball"), with_target(0.3));
  a.set_hand(pressing(3.0));
  b.set_hand(pressing(3.0));
  Largest largest;
  for (int i = 0; i < 10'000; ++i) {
    a.step();
    b.step();
    largest.see(rt::norm(a.truth().tip_position_mm - b.truth().tip_position_mm));
    largest.see(rt::norm(a.record().device_command_n - b.record().device_command_n));
  }
  return largest.value();
}

/// Commands of NaN, infinity and 1e300 in the midst of a press: what the tip makes of them, in mm.
double rig_commanded_nan(const Effort&) {
  auto rig = std::move(*sim::SimulatedRig::create(rig_of("none")));
  Largest largest;
  hal::RigSample sample;
  hal::TruthSample truth;
  for (int i = 0; i < 5000; ++i) {
    rig->read(sample);
    rig->truth(truth);
    if (i > 1000) largest.see(1e-3 * rt::norm(truth.tip_position_mm));
    const double bad = i % 3 == 0   ? std::nan("")
                       : i % 3 == 1 ? std::numeric_limits<double>::infinity()
                                    : 1e300;
    rig->write({{0.0, 0.0, i % 10 == 0 ? bad : 0.0}});
  }
  return largest.value();
}

}  // namespace

ExtremeGroup simulator_extremes() {
  return {
      "simulator",
      "Simulated rig: integrator, matter, friction, sensor",
      {
          {"axis dynamics", "k_s 1e-4 … 1e3 N/mm, step 1 ms", "one step against ten", "1",
           1.8e4 * 5.9e3 * kEpsilon, "ε |A h| |exp A h|, 1.8e4 and 5.9e3", axis_split},
          {"axis dynamics", "undamped for ten hours, a step a millisecond", "change of the energy", "1",
           36e6 * 63.0 * kEpsilon, "ε |A h| a step, |A h| = 63", axis_energy},
          {"material", "1e-4 … 1e3 N/mm, tips of 0 … 1e3 mm/N, jumps", "left of its equation", "1", 1e-9,
           "solved to 1e-9, never pulls", material_solved},
          {"material", "1e-4 … 1e3 N/mm, held for an hour", "from the elastic law", "1", 1e-9,
           "all branches have faded", material_held},
          {"friction", "loads 1e-12 … 35 N, slides to 1 m a step", "force over the most there can be", "1",
           1.0, "breakaway level and bristle damping", friction_level},
          {"friction", "pulled back and forth below half of breakaway, an hour", "creep", "mm", 0.007,
           "finest encoder step", friction_vibrated},
          {"Nano17", "NaN load", "ticks until right again", "ticks", 0.0, "left out, flagged", sensor_nan},
          {"Nano17", "1e6 N", "beyond its range", "N", 0.0, "±25 and ±35 N, flagged", sensor_saturated},
          {"Nano17", "7 million samples of one load", "error in standard errors", "1", 5.0, "five sigma",
           sensor_mean},
          {"whole rig", "two minutes of taps at 400 mm/s on wood, k~ = 100 × k", "largest of 1 m, 100 N", "1",
           1.0, "stays on the table",
           [](const Effort& e) { return rig_bounded("wood_plate", 1000.0, 2.0, e); }},
          {"whole rig", "ten minutes of taps at 400 mm/s on a sponge, k~ = 0", "largest of 1 m, 100 N", "1",
           1.0, "stays on the table",
           [](const Effort& e) { return rig_bounded("sponge_block", 0.0, 10.0, e); }},
          {"whole rig", "the same ten seconds twice", "difference", "mm, N", 0.0, "bit-repeatable",
           rig_repeats},
          {"whole rig", "commands of NaN, ∞, 1e300", "tip from home", "m", 1.0, "no DAC has a code for it",
           rig_commanded_nan},
      }};
}

}  // namespace hapticd::study::extremes
