// The general law: calibration, power law, energy, hysteresis, order, extremes.

#include "hal/sim/object/general_material.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "hal/sim/base/random.h"
#include "hal/sim/object/object_model.h"
#include "material_bench.h"

namespace hapticd::sim {
namespace {

using GeneralDepthControl = test::DepthControlOf<GeneralMaterial>;
using GeneralForceControl = test::ForceControlOf<GeneralMaterial>;
using MovingMass = test::MovingMassOf<GeneralMaterial>;

/// Linear, without skin; memory as a test names it.
GeneralMaterial spring_with(const GeneralMaterialParameters& memory, double step_s, double n_per_mm = 0.5) {
  return {test::spring(n_per_mm), memory, step_s};
}

GeneralMaterialParameters nothing() {
  return {.fading_share = 0.0, .strain_growth = 0.0};
}

class GeneralMatter : public testing::TestWithParam<std::string> {
 protected:
  ObjectModel object = *object_preset(GetParam());
  double depth_at_4n_mm = 4.0 / object.material.stiffness_at_4n_n_per_mm;
  GeneralMaterial matter(double step_s) const { return {object.material, object.general_material, step_s}; }
};
INSTANTIATE_TEST_SUITE_P(Presets, GeneralMatter, testing::ValuesIn(test::objects_of_different_matter()),
                         [](const auto& tested) { return tested.param; });

// D§3.2.2, as of the separable family: loaded at 0.5 N/s, force over displacement at 4 N.
TEST_P(GeneralMatter, SecantStiffnessAt4NewtonIsTheSeparableOnes) {
  for (const double step_s : {1e-4, 1e-3}) {
    GeneralForceControl press(matter(step_s));
    Material::Step step;
    const int steps = static_cast<int>(std::lround(8.0 / step_s));
    for (int i = 0; i < steps; ++i) step = press.apply(0.5 * (i + 0.5) * step_s);
    ASSERT_NEAR(step.force_n, 4.0, 0.01);
    EXPECT_NEAR(4.0 / step.depth_mm / object.material.stiffness_at_4n_n_per_mm, 1.0, 1e-3) << step_s;
  }
}

TEST_P(GeneralMatter, NeverPulls) {
  test::expect_never_pulls([&](double step_s) { return matter(step_s); }, 2.0 * depth_at_4n_mm);
}

TEST_P(GeneralMatter, NoForceWithoutTouch) {
  GeneralMaterial material = matter(1e-4);
  test::expect_no_force_without_touch(material);
  EXPECT_EQ(material.stored_n_mm(), 0.0);
}

// At every moment: what was put in is at least what is held. No tolerance but rounding: the step takes in its
// exact work.
TEST_P(GeneralMatter, NoPathAndNoStepGainsWork) {
  for (const double step_s : {1e-4, 3e-3}) {
    Random random(23);
    GeneralDepthControl tip(matter(step_s));
    double target_mm = 0.0, max_n_mm = 0.0;
    for (int i = 0; i < 20'000; ++i) {
      if (i % 50 == 0) target_mm = (1.7 * random.uniform() - 0.2) * depth_at_4n_mm;
      const double fastest_mm = 0.05 * depth_at_4n_mm;
      tip.move_to(tip.depth_mm() + std::clamp(target_mm - tip.depth_mm(), -fastest_mm, fastest_mm));
      max_n_mm = std::max(max_n_mm, tip.work_n_mm());
      ASSERT_GE(tip.work_n_mm(), tip.material().stored_n_mm() - 1e-10 * max_n_mm - 1e-12)
          << step_s << " s, step " << i;
    }
  }
}

TEST_P(GeneralMatter, ClosedCyclesDissipateAtAnyRate) {
  // The slower the less of it is time's, but a share stays.
  for (const double period_s : {0.02, 1.0, 60.0}) {
    const int half = 2000;
    GeneralDepthControl tip(matter(period_s / (2.0 * half)));
    const double depth_mm = 0.8 * depth_at_4n_mm;
    double loading_n_mm = 0.0;
    for (int i = 1; i <= 2 * half; ++i) {
      tip.move_to(depth_mm * (i <= half ? i : 2 * half - i) / half);
      if (i == half) loading_n_mm = tip.work_n_mm();
    }
    EXPECT_GT(tip.work_n_mm(), 0.01 * loading_n_mm) << period_s << " s";
    EXPECT_LT(tip.work_n_mm(), 0.9 * loading_n_mm) << period_s << " s";
  }
}

TEST_P(GeneralMatter, FasterIsStiffer) {
  test::expect_faster_is_stiffer([&](double step_s) { return matter(step_s); }, 0.5 * depth_at_4n_mm,
                                 {0.01, 0.1, 1.0, 10.0, 100.0, 400.0});
}

TEST_P(GeneralMatter, SurfaceComesBackAfterTheTipHasLeft) {
  GeneralDepthControl tip(matter(1e-3));
  const double depth_mm = 0.8 * depth_at_4n_mm;
  for (int i = 1; i <= 200; ++i) tip.move_to(depth_mm * i / 200);
  for (int i = 0; i < 3000; ++i) tip.move_to(depth_mm);
  Material::Step step;
  do {
    step = tip.move_to(tip.depth_mm() - 0.01 * depth_mm);
  } while (step.mean_force_n > 0.0);
  EXPECT_EQ(step.force_n, 0.0);
  const double left_mm = tip.material().depression_mm();
  EXPECT_GE(left_mm, tip.depth_mm()) << "the tip is out of the matter";
  EXPECT_LT(left_mm, 0.9 * depth_mm);
  double last_mm = left_mm, last_n_mm = tip.material().stored_n_mm();
  for (int i = 0; i < 100'000; ++i) {
    EXPECT_EQ(tip.move_to(-1.0).force_n, 0.0);
    ASSERT_LE(tip.material().depression_mm(), last_mm + 1e-9) << i;
    ASSERT_LE(tip.material().stored_n_mm(), last_n_mm * (1.0 + 1e-9) + 1e-12) << "no one works on it";
    last_mm = tip.material().depression_mm();
    last_n_mm = tip.material().stored_n_mm();
  }
  EXPECT_LT(last_mm, 0.7 * left_mm + 1e-6) << "a power law takes its time";
}

TEST_P(GeneralMatter, ABouncingMassNeverRisesHigherThanBefore) {
  for (const double step_s : {1e-4, 1e-3}) {
    test::expect_never_rises_higher(matter(step_s), step_s, 2.0, {0.1, 10.0, 100.0}, {1e-6, 1e-6});
  }
}

TEST_P(GeneralMatter, ExtremesStayFinite) {
  for (const double depth_mm : {1e-300, 1e-12, 1e3, 1e9}) {
    for (const double compliance : {0.0, 1e-12, 1e6}) {
      GeneralMaterial material = matter(1e-4);
      for (int i = 0; i < 100; ++i) {
        const Material::Step step = material.advance(i % 7 == 6 ? -depth_mm : depth_mm, compliance);
        ASSERT_TRUE(std::isfinite(step.mean_force_n) && std::isfinite(step.force_n) &&
                    std::isfinite(step.depth_mm));
        ASSERT_TRUE(std::isfinite(material.stored_n_mm()));
        ASSERT_GE(step.mean_force_n, 0.0);
      }
    }
  }
}

TEST(GeneralMatterStiff, AnyStiffnessIsStable) {
  // Two masses' worth of weight on matter from 1e-3 to 1e5 N/mm: it comes to rest, at any step.
  const ObjectModel wood = *object_preset("wood_plate");
  for (const double stiffness : {1e-3, 1.0, 1e3, 1e5}) {
    for (const double step_s : {1e-4, 1e-3}) {
      MaterialParameters shape = wood.material;
      shape.stiffness_at_4n_n_per_mm = stiffness;
      MovingMass mass({shape, wood.general_material, step_s}, 0.05, step_s);
      mass.depth_mm = -0.1;
      double start_n_mm = 0.05 * 9.807 * 0.1;
      for (int i = 0; i < static_cast<int>(3.0 / step_s); ++i) {
        mass.step(0.05 * 9.807);
        ASSERT_TRUE(std::isfinite(mass.depth_mm));
        ASSERT_LE(mass.kinetic_n_mm() - 0.05 * 9.807 * mass.depth_mm, start_n_mm + 1e-6);
      }
    }
  }
}

class GeneralConvergence : public testing::TestWithParam<std::string> {};
INSTANTIATE_TEST_SUITE_P(Presets, GeneralConvergence,
                         testing::Values("sponge_block", "foam_ball", "rubber_ball", "rubber_eraser",
                                         "sponge_cut", "silicone_rest", "sticky_gel"),
                         [](const auto& tested) { return tested.param; });

// Second order while steps are below twice the fastest mode's time, 0.4 ms; the hysteresis' reversals take
// off some.
TEST_P(GeneralConvergence, IsOfNearlySecondOrder) {
  const ObjectModel object = *object_preset(GetParam());
  const auto path_mm = [&](double step_s) {
    return test::pressed_path_mm(GeneralMaterial(object.material, object.general_material, step_s), step_s);
  };
  const auto reference = path_mm(0.5e-3 / 64.0);
  const double coarse_mm = test::worst_difference(path_mm(0.25e-3), reference);
  const double fine_mm = test::worst_difference(path_mm(0.0625e-3), reference);
  const double order = 0.5 * std::log2(coarse_mm / fine_mm);
  RecordProperty("order", std::to_string(order));
  RecordProperty("error_mm_at_0.25_ms", std::to_string(coarse_mm));
  EXPECT_GE(order, 1.6) << coarse_mm << " mm, " << fine_mm << " mm";
  EXPECT_LT(coarse_mm, 0.01 * reference.back()) << "a hundredth of the depth at a quarter of a millisecond";
}

class Power : public testing::TestWithParam<double> {};
INSTANTIATE_TEST_SUITE_P(Powers, Power, testing::Values(0.03, 0.1, 0.27, 0.5));

// Held at a depth, the force is a straight line of slope -power on a log-log plot, from 10 ms to 300 s.
TEST_P(Power, AHeldDepthFadesByThePower) {
  GeneralMaterialParameters memory = nothing();
  memory.fading_share = 1.0;
  memory.power = GetParam();
  constexpr double kStepS = 1e-3;
  GeneralDepthControl tip(spring_with(memory, kStepS));
  double t_s = 0.5 * kStepS, n = 0.0, x_sum = 0.0, y_sum = 0.0, xx = 0.0, xy = 0.0;
  std::vector<std::pair<double, double>> points;
  double next_s = 0.01;
  tip.move_to(2.0);
  while (t_s < 300.0) {
    const double force_n = tip.move_to(2.0).force_n;
    t_s += kStepS;
    if (t_s < next_s) continue;
    next_s *= 1.2;
    points.emplace_back(std::log(t_s), std::log(force_n));
    n += 1.0;
    x_sum += points.back().first;
    y_sum += points.back().second;
    xx += points.back().first * points.back().first;
    xy += points.back().first * points.back().second;
  }
  const double slope = (n * xy - x_sum * y_sum) / (n * xx - x_sum * x_sum);
  EXPECT_NEAR(slope, -GetParam(), 0.01 * GetParam());
  for (const auto& [x, y] : points) {
    ASSERT_NEAR(y, y_sum / n + slope * (x - x_sum / n), 0.01) << std::exp(x) << " s: no exponential bends it";
  }
}

/// Share of the force at a held depth that is left after a second.
double left_of_force(const GeneralMaterial& law, double depth_mm) {
  GeneralDepthControl tip(law);
  const double first_n = tip.move_to(depth_mm).force_n;
  double force_n = 0.0;
  for (int i = 0; i < 1000; ++i) force_n = tip.move_to(depth_mm).force_n;
  return force_n / first_n;
}

TEST(GeneralLaw, DenserIsSlower) {
  // The same step of strain, near the surface and deep: deep, less of it has faded.
  GeneralMaterialParameters memory = nothing();
  memory.fading_share = 1.0;
  memory.power = 0.2;
  memory.slower_when_dense = 10.0;
  const GeneralMaterial law = spring_with(memory, 1e-3);
  EXPECT_GT(left_of_force(law, 8.0), 1.1 * left_of_force(law, 0.5));
}

TEST(GeneralLaw, PoresStiffenFasterThanTheRate) {
  // Below the undrained limit the force that drains grows faster than the speed: Darcy alone would keep the
  // ratio.
  GeneralMaterialParameters memory = nothing();
  memory.pore_share = 1.0;
  memory.pore_time_s = 1e-3;
  memory.pore_strain_rate_per_s = 1.0;
  const auto draining_n = [&](double strain_rate_per_s) {
    constexpr double kDepthMm = 4.0;
    const GeneralMaterial law = spring_with(memory, kDepthMm / 8.0 / strain_rate_per_s / 2000.0);
    GeneralDepthControl tip(law);
    double force_n = 0.0;
    for (int i = 1; i <= 2000; ++i) force_n = tip.move_to(kDepthMm * i / 2000).force_n;
    return force_n - law.settled_force_n(kDepthMm);
  };
  EXPECT_GT(draining_n(10.0) / draining_n(1.0), 15.0);
  EXPECT_NEAR(draining_n(0.02) / draining_n(0.01), 2.0, 0.05) << "slowly it is Darcy's";
  EXPECT_LT(draining_n(1e5), draining_n(1e6) * 1.01);
  EXPECT_NEAR(draining_n(1e6) / draining_n(1e7), 1.0, 0.01) << "undrained";
}

TEST(GeneralLaw, HysteresisDoesNotAskForTime) {
  GeneralMaterialParameters memory = nothing();
  memory.slips = {{{0.5, 0.05}, {0.5, 0.1}, {0.5, 0.2}}};
  const auto cycle = [&](double step_s) {
    GeneralDepthControl tip(spring_with(memory, step_s));
    std::vector<double> forces;
    for (int i = 1; i <= 400; ++i)
      forces.push_back(tip.move_to(8.0 * (i <= 200 ? i : 400 - i) / 200).force_n);
    forces.push_back(tip.work_n_mm());
    return forces;
  };
  const std::vector<double> slow = cycle(1.0);
  EXPECT_EQ(slow, cycle(1e-4)) << "bit for bit";
  EXPECT_GT(slow[99], slow[299] * 1.2) << "on the way in more than on the way out, at half the depth";
  EXPECT_NEAR(slow[399], 0.0, 1e-12) << "closed at zero: no dent stays";
  // Loading work K (1 + Σ share limit)/2, of which twice the sum's part is lost, less the turn's.
  const double loading_n_mm = 0.5 * slow[199] * 8.0;
  EXPECT_GT(slow.back(), 0.15 * loading_n_mm);
  EXPECT_LT(slow.back(), 2.0 * 0.175 / 1.175 * loading_n_mm);
}

TEST(GeneralLaw, NoCreepLawAndNoProductOfDepthAndTime) {
  // A separable law relaxes by the same function of time at every depth; here the ratio differs.
  const ObjectModel sponge = *object_preset("sponge_block");
  const GeneralMaterial law(sponge.material, sponge.general_material, 1e-3);
  const double at_4n_mm = 4.0 / sponge.material.stiffness_at_4n_n_per_mm;
  EXPECT_GT(std::abs(left_of_force(law, at_4n_mm) - left_of_force(law, 0.3 * at_4n_mm)), 0.05);
}

}  // namespace
}  // namespace hapticd::sim
