// Object presets: what the dissertation says of them, and what physics asks of any object.

#include "hal/sim/object/object_model.h"

#include <gtest/gtest.h>

#include <map>
#include <set>
#include <string>
#include <vector>

namespace hapticd::sim {
namespace {

TEST(ObjectPreset, StiffnessIsTheDissertations) {
  const std::map<std::string, double> published_n_per_mm{{"sponge_block", 0.38},
                                                         {"rubber_ball", 0.59},
                                                         {"rubber_eraser", 2.26},
                                                         {"sponge_cut", 0.18},
                                                         {"foam_ball_3d", 0.33}};
  for (const auto& [name, stiffness] : published_n_per_mm) {
    ASSERT_TRUE(object_preset(name)) << name;
    EXPECT_EQ(object_preset(name)->material.stiffness_at_4n_n_per_mm, stiffness) << name;
  }
  EXPECT_GT(object_preset("foam_ball")->material.stiffness_at_4n_n_per_mm, 0.38) << "between sponge";
  EXPECT_LT(object_preset("foam_ball")->material.stiffness_at_4n_n_per_mm, 0.59) << "and rubber";
  EXPECT_GE(object_preset("wood_plate")->material.stiffness_at_4n_n_per_mm, 50.0);
}

TEST(ObjectPreset, AllThatWereUsedAreThere) {
  for (const char* name :
       {"sponge_block", "foam_ball", "rubber_ball", "rubber_eraser", "sponge_cut", "foam_ball_3d",
        "rubber_ball_3d", "silicone_rest", "wood_plate", "sticky_gel", "foam_ridge"}) {
    EXPECT_TRUE(object_preset(name)) << name;
  }
  EXPECT_FALSE(object_preset("anvil"));
  EXPECT_FALSE(object_preset("none")) << "an empty table is no object";
}

TEST(ObjectPreset, MatterIsPassiveAndRemembers) {
  for (const std::string& name : object_preset_names()) {
    const ObjectModel object = *object_preset(name);
    const MaterialParameters& m = object.material;
    EXPECT_EQ(object.name, name);
    EXPECT_NEAR(m.linear + m.quadratic + m.densifying, 1.0, 1e-12) << name;
    EXPECT_GT(m.linear, 0.0) << name;
    EXPECT_GE(m.quadratic, 0.0) << name;
    EXPECT_GE(m.densifying, 0.0) << name;
    int branches = 0;
    for (const RelaxationBranch& branch : m.branches) {
      EXPECT_GE(branch.share, 0.0) << name;
      EXPECT_GT(branch.time_s, 0.0) << name;
      branches += branch.share > 0.0 ? 1 : 0;
    }
    EXPECT_GE(branches, 2) << name << ": hysteresis and slow recovery need two";
    EXPECT_GE(m.skin_stiffness_n_per_mm, 0.0) << name;
    EXPECT_GE(m.skin_viscosity_n_s_per_mm, 0.0) << name;
    EXPECT_GT(m.skin_depth_mm, 0.0) << name;
    for (const FrictionParameters& f : {object.friction, object.friction_bearing}) {
      EXPECT_GT(f.kinetic, 0.0) << name;
      EXPECT_GE(f.static_ratio, 1.0) << name << ": Stribeck drops from static to kinetic";
      EXPECT_GT(f.presliding_mm, 0.0) << name;
      EXPECT_GT(f.ripple_share, 0.0) << name << ": no real path is even";
      EXPECT_LT(f.ripple_share, 1.0) << name;
      EXPECT_GT(f.ripple_wavelength_mm, 0.0) << name;
    }
  }
}

TEST(ObjectPreset, ABallBearingRollsMuchTheSameOnAll) {
  double sum = 0.0;
  const std::set<std::string> averaged{"sponge_cut", "foam_ball_3d", "rubber_ball_3d", "silicone_rest"};
  for (const std::string& name : object_preset_names()) {
    const ObjectModel object = *object_preset(name);
    EXPECT_LT(object.friction_bearing.kinetic, 0.2 * object.friction.kinetic) << name;
    EXPECT_LT(object.friction_bearing.static_ratio, 1.05) << name;
    EXPECT_NEAR(2.0 * object.friction_bearing.viscous_s_per_mm, 2.4e-4, 1e-9) << name << ": at 2 N";
    if (averaged.contains(name)) sum += object.friction_bearing.kinetic;
  }
  // One model for the four: identified as 0.0643, too low on the first three and too high on the last.
  EXPECT_NEAR(sum / 4.0, 0.0643, 0.005);
  EXPECT_LT(object_preset("silicone_rest")->friction_bearing.kinetic, 0.0643);
  for (const char* name : {"sponge_cut", "foam_ball_3d", "rubber_ball_3d"}) {
    EXPECT_GT(object_preset(name)->friction_bearing.kinetic, 0.0643) << name;
  }
}

TEST(ObjectPreset, EveryShapeTouchesTheOriginAndStaysBelow) {
  for (const std::string& name : object_preset_names()) {
    const Shape shape = object_preset(name)->shape;
    EXPECT_NEAR(project(shape, {0.0, 0.0, 0.0}).depth_mm, 0.0, 1e-12) << name;
    for (double x = -20.0; x <= 20.0; x += 2.5) {
      EXPECT_LE(project(shape, {x, 0.5 * x, 0.0}).depth_mm, 1e-12) << name;
    }
  }
}

}  // namespace
}  // namespace hapticd::sim
