// What matter remembers: relaxation, rate, hysteresis, recovery.

#include <gtest/gtest.h>

#include <cmath>
#include <complex>
#include <numbers>
#include <string>

#include "hal/sim/base/random.h"
#include "hal/sim/object/object_model.h"
#include "material_bench.h"

namespace hapticd::sim {
namespace {

using test::DepthControl;

class Memory : public testing::TestWithParam<std::string> {
 protected:
  MaterialParameters parameters = object_preset(GetParam())->material;
  double depth_at_4n_mm = 4.0 / parameters.stiffness_at_4n_n_per_mm;
};

INSTANTIATE_TEST_SUITE_P(Presets, Memory, testing::ValuesIn(test::objects_of_different_matter()),
                         [](const auto& tested) { return tested.param; });

// After a step to a held depth each branch fades by itself: F(t)/F(∞) = 1 + Σ g exp(-t/τ).
TEST_P(Memory, ForceAtHeldDepthFadesWithTheBranches) {
  constexpr double kStepS = 1e-5;  // short against the fastest branch, so that the push is a step
  DepthControl tip(parameters, kStepS);
  const double depth_mm = 0.7 * depth_at_4n_mm;
  tip.move_to(depth_mm);
  std::vector<std::pair<double, double>> early;
  double t_s = 0.5 * kStepS;  // the push is centred in the first step
  for (int i = 1; i <= 20'000; ++i) {
    t_s += kStepS;
    const double force_n = tip.move_to(depth_mm).force_n;
    if (i % 50 == 0) early.emplace_back(t_s, force_n);
  }
  const double settled_n = tip.material().elastic_force_n(depth_mm);
  for (const auto& [time_s, force_n] : early) {
    double expected = 1.0;
    for (const RelaxationBranch& b : parameters.branches) expected += b.share * std::exp(-time_s / b.time_s);
    ASSERT_NEAR(force_n / settled_n, expected, 1e-4) << time_s << " s";
  }
}

TEST_P(Memory, FasterIsStiffer) {
  test::expect_faster_is_stiffer([&](double step_s) { return Material(parameters, step_s); },
                                 0.5 * depth_at_4n_mm, {0.1, 1.0, 10.0, 100.0, 400.0});
}

TEST_P(Memory, ClosedLoadCyclesDissipate) {
  Random random(17);
  for (int cycle = 0; cycle < 200; ++cycle) {
    DepthControl tip(parameters, 1e-4);
    // Down to a random depth and out again, each way at its own speed, with a relief and a halt on the way.
    const double depth_mm = (0.05 + 0.95 * random.uniform()) * depth_at_4n_mm;
    for (const double to_mm : {0.6 * depth_mm, 0.4 * depth_mm, depth_mm, depth_mm, -0.5}) {
      const double speed_mm_per_s = 5.0 * std::pow(60.0, random.uniform());
      const double from_mm = tip.depth_mm();
      const int steps = 1 + static_cast<int>(std::abs(to_mm - from_mm) / speed_mm_per_s / 1e-4);
      for (int i = 1; i <= steps; ++i) tip.move_to(from_mm + (to_mm - from_mm) * i / steps);
      ASSERT_GE(tip.work_n_mm(), 0.0);
    }
    ASSERT_GT(tip.work_n_mm(), 0.0);
  }
}

TEST_P(Memory, NoPathGainsWork) {
  Random random(23);
  DepthControl tip(parameters, 1e-4);
  double target_mm = 0.0;
  for (int i = 0; i < 30'000; ++i) {
    if (i % 50 == 0) target_mm = (1.2 * random.uniform() - 0.2) * depth_at_4n_mm;
    const double change_mm = std::clamp(target_mm - tip.depth_mm(), -0.02, 0.02);
    tip.move_to(tip.depth_mm() + change_mm);
    ASSERT_GE(tip.work_n_mm(), -1e-9) << "step " << i;
  }
}

TEST_P(Memory, SurfaceComesBackAfterTheTipHasLeft) {
  DepthControl tip(parameters, 1e-4);
  const double depth_mm = 0.8 * depth_at_4n_mm;
  const double speed_mm_per_s = 200.0;
  while (tip.depth_mm() < depth_mm) tip.move_to(std::min(depth_mm, tip.depth_mm() + 1e-4 * speed_mm_per_s));
  for (int i = 0; i < 30'000; ++i) tip.move_to(depth_mm);
  // Out again, faster than the surface can follow.
  Material::Step step;
  do {
    step = tip.move_to(tip.depth_mm() - 1e-4 * speed_mm_per_s);
  } while (step.mean_force_n > 0.0);
  EXPECT_EQ(step.force_n, 0.0);
  const double left_mm = tip.material().depression_mm();
  EXPECT_GT(left_mm, 0.0) << "the dent outlasts the contact";
  EXPECT_GE(left_mm, tip.depth_mm()) << "and the tip is out of the matter";
  double last_mm = left_mm;
  for (int i = 0; i < 200'000; ++i) {
    tip.move_to(-1.0);
    ASSERT_LE(tip.material().depression_mm(), last_mm + 1e-9) << i;
    last_mm = tip.material().depression_mm();
  }
  EXPECT_LT(last_mm, 0.01 * left_mm);
}

MaterialParameters standard_solid(double share, double time_s) {
  MaterialParameters p = test::spring(0.5);
  p.branches[0] = {share, time_s};
  return p;
}

// With force held at zero, E x + q = 0 and q̇ = g E ẋ - q/τ: the dent fades with τ (1 + g), slower than force
// relaxes.
TEST(Recovery, AStandardSolidsDentFadesWithItsRetardationTime) {
  constexpr double kShare = 0.5, kTimeS = 0.2, kStepS = 1e-4;
  DepthControl tip(standard_solid(kShare, kTimeS), kStepS);
  for (int i = 1; i <= 100; ++i) tip.move_to(0.05 * i);
  for (int i = 0; i < 20'000; ++i) tip.move_to(5.0);  // all of the branch has faded
  // Unloaded at once: (1 + g) E Δx = -E x, so g/(1+g) of the depth is left at first.
  for (int i = 1; i <= 50; ++i) tip.move_to(5.0 - 0.1 * i);
  EXPECT_NEAR(tip.material().depression_mm(), 5.0 * kShare / (1.0 + kShare), 3e-2);
  tip.move_to(-1.0);
  const double start_mm = tip.material().depression_mm();
  for (int i = 1; i <= 5000; ++i) {
    tip.move_to(-1.0);
    const double expected_mm = start_mm * std::exp(-i * kStepS / (kTimeS * (1.0 + kShare)));
    ASSERT_NEAR(tip.material().depression_mm(), expected_mm, 1e-3) << i;
  }
}

// Creep: constant force, so ẋ carries the fading branch; x(t) = F/E (1 - g/(1+g) exp(-t/(τ (1+g)))).
TEST(Recovery, AStandardSolidCreepsUnderConstantForce) {
  constexpr double kShare = 0.5, kTimeS = 0.2, kStepS = 1e-4;
  test::ForceControl press(standard_solid(kShare, kTimeS), kStepS);
  double settled_mm = 0.0;
  press.apply(0.5);
  for (int i = 0; i < 60'000; ++i) settled_mm = press.apply(1.0).depth_mm;

  test::ForceControl fresh(standard_solid(kShare, kTimeS), kStepS);
  fresh.apply(0.5);  // mean over the step in which the force comes up
  for (int i = 1; i <= 4000; ++i) {
    const double depth_mm = fresh.apply(1.0).depth_mm;
    const double t_s = (i + 0.5) * kStepS;
    const double expected = 1.0 - kShare / (1.0 + kShare) * std::exp(-t_s / (kTimeS * (1.0 + kShare)));
    ASSERT_NEAR(depth_mm / settled_mm, expected, 1e-4) << t_s;
  }
}

// Small oscillation around a depth: complex modulus 1 + Σ g iωτ/(1 + iωτ) of the elastic one.
TEST(Viscoelasticity, OscillationMeetsTheComplexModulus) {
  MaterialParameters p = test::spring(0.5);
  p.branches = {{{0.2, 0.008}, {0.2, 0.15}, {0.25, 3.0}}};
  for (const double frequency_hz : {0.5, 2.0, 10.0, 40.0}) {
    const double omega = 2.0 * std::numbers::pi * frequency_hz;
    const int steps = 1000;  // a cycle
    DepthControl tip(p, 1.0 / frequency_hz / steps);
    constexpr double kMeanMm = 4.0, kAmplitudeMm = 1.0;
    tip.move_to(kMeanMm);
    std::complex<double> modulus;
    const int settling = static_cast<int>(std::ceil(30.0 * frequency_hz));
    for (int i = 1; i <= (settling + 1) * steps; ++i) {
      const double phase = 2.0 * std::numbers::pi * i / steps;
      const double force_n = tip.move_to(kMeanMm + kAmplitudeMm * std::sin(phase)).force_n;
      if (i > settling * steps)
        modulus += force_n * std::polar(2.0 / steps, -phase) * std::complex<double>(0.0, 1.0);
    }
    const double elastic_n_per_mm = tip.material().elastic_force_n(1.0);
    std::complex<double> expected = 1.0;
    for (const RelaxationBranch& b : p.branches) {
      const std::complex<double> turn(0.0, omega * b.time_s);
      expected += b.share * turn / (1.0 + turn);
    }
    EXPECT_LT(std::abs(modulus / elastic_n_per_mm - expected), 2e-3) << frequency_hz << " Hz";
  }
}

}  // namespace
}  // namespace hapticd::sim
