// The elastic law: representative stiffness, onset, densification, sign.

#include <gtest/gtest.h>

#include <cmath>
#include <string>

#include "hal/sim/object/object_model.h"
#include "material_bench.h"

namespace hapticd::sim {
namespace {

using test::DepthControl;
using test::ForceControl;

class Matter : public testing::TestWithParam<std::string> {
 protected:
  MaterialParameters parameters = object_preset(GetParam())->material;
};

INSTANTIATE_TEST_SUITE_P(Presets, Matter, testing::ValuesIn(test::objects_of_different_matter()),
                         [](const auto& tested) { return tested.param; });

// D§3.2.2: loaded at 0.5 N/s, force over displacement at 4 N.
TEST_P(Matter, SecantStiffnessAt4NewtonIsTheRepresentativeOne) {
  constexpr double kStepS = 1e-3;
  ForceControl press(parameters, kStepS);
  Material::Step step;
  for (int i = 0; i < 8000; ++i) step = press.apply(0.5 * (i + 0.5) * kStepS);
  ASSERT_NEAR(step.force_n, 4.0, 0.01);
  EXPECT_NEAR(4.0 / step.depth_mm / parameters.stiffness_at_4n_n_per_mm, 1.0, 0.01);
}

TEST_P(Matter, ForceGrowsFromNothingAtContact) {
  // One step that ends a hair below the surface at 100 mm/s. Nothing in the law is steeper there than its
  // slopes: elastic, with all branches still stiff, plus viscosity's c/d times speed.
  double share = 1.0;
  for (const RelaxationBranch& branch : parameters.branches) share += branch.share;
  const double elastic_n_per_mm =
      parameters.stiffness_at_4n_n_per_mm * parameters.linear + parameters.skin_stiffness_n_per_mm;
  const double viscous_n_per_mm = 100.0 * parameters.skin_viscosity_n_s_per_mm / parameters.skin_depth_mm;
  for (const double depth_mm : {1e-2, 1e-4, 1e-6}) {
    DepthControl tip(parameters, depth_mm / 100.0);
    const Material::Step step = tip.move_to(depth_mm);
    EXPECT_GT(step.force_n, 0.0);
    EXPECT_LE(step.force_n, 1.1 * (share * elastic_n_per_mm + viscous_n_per_mm) * depth_mm);
  }
}

TEST_P(Matter, NeverPulls) {
  test::expect_never_pulls([&](double step_s) { return Material(parameters, step_s); },
                           8.0 / parameters.stiffness_at_4n_n_per_mm);
}

TEST_P(Matter, NoForceWithoutTouch) {
  test::expect_no_force_without_touch(Material(parameters, 1e-4));
}

TEST(Elasticity, FollowsItsLawWithoutSkin) {
  // a u + b u² + c max(0, (u - u_d)/(1 - u_d))³ over the depth at 4 N.
  MaterialParameters p = test::spring(0.5);
  p.linear = 0.3;
  p.quadratic = 0.2;
  p.densifying = 0.5;
  p.densification_onset = 0.6;
  const Material material(p, 1e-3);
  for (double u = 0.05; u < 2.0; u += 0.05) {
    const double dense = u > 0.6 ? std::pow((u - 0.6) / 0.4, 3.0) : 0.0;
    EXPECT_NEAR(material.elastic_force_n(8.0 * u), 4.0 * (0.3 * u + 0.2 * u * u + 0.5 * dense), 1e-12);
  }
}

TEST(Elasticity, SpongeDensifies) {
  // Incremental stiffness: nearly constant before the onset, several times that at the depth of 4 N.
  const MaterialParameters p = object_preset("sponge_block")->material;
  const Material sponge(p, 1e-3);
  const double at_4n_mm = 4.0 / p.stiffness_at_4n_n_per_mm;
  const auto incremental = [&](double u) {
    constexpr double kH = 1e-3;
    return (sponge.elastic_force_n((u + kH) * at_4n_mm) - sponge.elastic_force_n((u - kH) * at_4n_mm)) /
           (2.0 * kH * at_4n_mm);
  };
  EXPECT_LT(incremental(0.34) / incremental(0.15), 1.5);
  EXPECT_GT(incremental(1.0) / incremental(0.34), 5.0);
}

TEST(Elasticity, EraserIsTheMostLinearOfTheFour) {
  const auto bend = [](const char* name) {  // force at half the depth, over half the force
    const MaterialParameters p = object_preset(name)->material;
    const Material material(p, 1e-3);
    const double at_4n_mm = 4.0 / p.stiffness_at_4n_n_per_mm;
    return material.elastic_force_n(0.5 * at_4n_mm) / (0.5 * material.elastic_force_n(at_4n_mm));
  };
  for (const char* other : {"sponge_block", "foam_ball", "rubber_ball"}) {
    EXPECT_LT(bend(other), bend("rubber_eraser")) << other;
    if (std::string(other) != "sponge_block") {
      EXPECT_LT(bend("sponge_block"), bend(other)) << other;
    }
  }
  EXPECT_GT(bend("rubber_eraser"), 0.9);
}

}  // namespace
}  // namespace hapticd::sim
