#include <gtest/gtest.h>

#include <limits>

#include "rt/scene/compose.h"
#include "rt/scene/scene_spec.h"
#include "tests/support/value_of.h"

namespace hapticd::rt {
namespace {

hal::RigInfo rig() {
  hal::RigInfo info;
  info.name = "bench";
  info.device = {"phantom_1_0", 8.5, 1.4, 0.03, 3.5, 75.0};
  info.sensor = {"nano17_si_25", 35.0, 1.0 / 640.0, 10000.0, 9.35};
  return info;
}

SceneSpec named() {
  SceneSpec spec;
  spec.name = "bench";
  return spec;
}

TEST(Scene, TakesFromTheDeviceWhatItLeavesOpen) {
  const auto scene = hapticd::test::value_of(resolve(named(), rig()));
  EXPECT_EQ(scene.structural_stiffness_n_per_mm, 3.5);
  EXPECT_EQ(scene.controller.proportional_gain, 0.45);
  EXPECT_EQ(scene.controller.derivative_gain_ms, 0.015);
  EXPECT_EQ(scene.guard.max_force_n, 8.5);
  EXPECT_EQ(scene.guard.max_force_rate_n_per_s, 1700.0);
  hal::RigInfo strong = rig();
  strong.device.model = "phantom_1_5_high_force";
  EXPECT_EQ(resolve(named(), strong)->controller.proportional_gain, 1.05);
}

TEST(Scene, TellsTheGuardTheToolThatTheRigKnows) {
  hal::RigInfo knows = rig();
  knows.sensor.tool_mass_g = 12.0;
  SceneSpec spec = named();
  spec.tool_mass_g = 500.0;
  EXPECT_EQ(resolve(spec, knows)->guard.tool.tool_mass_g, 12.0);
  EXPECT_EQ(resolve(spec, knows)->guard.tool.mass_error_g, 488.0)
      << "or the scene is right: neither is a load";
  knows.sensor.tool_mass_g = 0.0;
  EXPECT_EQ(resolve(spec, knows)->guard.tool.tool_mass_g, 500.0);
  EXPECT_EQ(resolve(spec, knows)->guard.tool.mass_error_g, 0.0);
}

TEST(Scene, NormalisesThePressAxis) {
  SceneSpec spec = named();
  spec.press_axis = {0.0, 3.0, -4.0};
  const auto scene = hapticd::test::value_of(resolve(spec, rig()));
  EXPECT_NEAR(scene.press_axis.y, 0.6, 1e-12);
  EXPECT_NEAR(scene.press_axis.z, -0.8, 1e-12);
}

TEST(Scene, RefusesByNameWithLimitAndValue) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  struct Case {
    const char* named;
    void (*spoil)(SceneSpec&, double);
    double value;
  };
  const auto target = [](SceneSpec& s, double v) { s.target.stiffness_n_per_mm = v; };
  const auto threshold = [](SceneSpec& s, double v) { s.contact.threshold_n = v; };
  const auto gain = [](SceneSpec& s, double v) { s.controller.proportional_gain = v; };
  const auto derivative = [](SceneSpec& s, double v) { s.controller.derivative_gain_ms = v; };
  const auto ratio = [](SceneSpec& s, double v) { s.contact.release_ratio = v; };
  const auto release = [](SceneSpec& s, double v) { s.contact.release_time_ms = v; };
  const auto lowest = [](SceneSpec& s, double v) { s.contact.evidence.lowest_stiffness_n_per_mm = v; };
  const auto axis = [](SceneSpec& s, double v) { s.press_axis = {0.0, 0.0, v}; };
  const auto force = [](SceneSpec& s, double v) { s.guard.max_force_n = v; };
  const auto rate = [](SceneSpec& s, double v) { s.guard.max_force_rate_n_per_s = v; };
  const auto mass = [](SceneSpec& s, double v) { s.tool_mass_g = v; };
  const auto lead = [](SceneSpec& s, double v) { s.compensation.reaction_lead_share = v; };
  for (const Case& c : {Case{"stiffness_n_per_mm", target, nan},
                        Case{"stiffness_n_per_mm", target, -0.1},
                        Case{"target's stiffness", target, 21.0},
                        Case{"target.stiffness_n_per_mm", target, 2.9},
                        Case{"contact.threshold_n", threshold, 5e-5},
                        Case{"contact.threshold_n", threshold, nan},
                        Case{"control.proportional_gain", gain, 0.049},
                        Case{"control.proportional_gain", gain, 1e-4},
                        Case{"control.proportional_gain", gain, 1.9},
                        Case{"contact.release_ratio", ratio, 1.0},
                        Case{"contact.release_time_ms", release, 0.1},
                        Case{"contact.lowest_stiffness_n_per_mm", lowest, 10.0},
                        Case{"control.proportional_gain", gain, 2.5},
                        Case{"control.proportional_gain", gain, -1.0},
                        Case{"control.derivative_gain_ms", derivative, -0.1},
                        Case{"control.derivative_gain_ms", derivative, nan},
                        Case{"press_axis", axis, 0.0},
                        Case{"press_axis", axis, nan},
                        Case{"guard.max_force_n", force, 9.0},
                        Case{"guard.max_force_rate_n_per_s", rate, 1701.0},
                        Case{"guard.max_force_rate_n_per_s", rate, nan},
                        Case{"tool.mass_g", mass, nan},
                        Case{"control.reaction_lead_share", lead, -0.1},
                        Case{"control.reaction_lead_share", lead, 1.1},
                        Case{"control.reaction_lead_share", lead, nan}}) {
    SceneSpec spec = named();
    spec.max_target_stiffness_n_per_mm = 20.0;
    c.spoil(spec, c.value);
    const auto scene = resolve(spec, rig());
    ASSERT_FALSE(scene) << c.named << " = " << c.value;
    EXPECT_EQ(scene.error().what, std::string(c.named) + " is out of range");
    EXPECT_EQ(scene.error().where.find("scene 'bench'"), 0U) << scene.error().where;
    EXPECT_FALSE(scene.error().limit.empty());
  }
}

TEST(Scene, TakesTheLargestTargetWhereItDoesNotSay) {
  const auto scene = test::value_of(resolve(named(), rig()));
  EXPECT_EQ(scene.max_target_stiffness_n_per_mm, 0.7) << "the structure's mode is not known";
  for (const auto& [mode_hz, largest] : {std::pair{70.0, 0.7}, {89.0, 0.7}, {90.0, 1.0}, {220.0, 1.0}}) {
    hal::RigInfo known = rig();
    known.device.structural_mode_hz = mode_hz;
    EXPECT_EQ(resolve(named(), known)->max_target_stiffness_n_per_mm, largest) << mode_hz << " Hz";
  }
  hal::RigInfo strong = rig();
  strong.device.model = "phantom_1_5_high_force";
  EXPECT_EQ(resolve(named(), strong)->max_target_stiffness_n_per_mm, 1.0);
  SceneSpec wall = named();
  wall.kind = SceneKind::kWall;
  EXPECT_EQ(resolve(wall, rig())->max_target_stiffness_n_per_mm, 1.3);
  SceneSpec bold = named();
  bold.max_target_stiffness_n_per_mm = 2.5;
  EXPECT_EQ(resolve(bold, rig())->max_target_stiffness_n_per_mm, 2.5) << "a scene may say more";
}

TEST(Scene, HoldsTheTargetWithinTheCompensablePartOfTheStructure) {
  SceneSpec spec = named();
  spec.max_target_stiffness_n_per_mm = 20.0;
  spec.target.stiffness_n_per_mm = 2.79;
  EXPECT_TRUE(resolve(spec, rig()));
  spec.target.stiffness_n_per_mm = 2.81;
  EXPECT_FALSE(resolve(spec, rig()));
  spec.structural_compensation = false;
  EXPECT_TRUE(resolve(spec, rig()));
}

/// 2.5 N/mm at its centre; the compliance grows by 0.2 over the 20 mm it covers to either side.
SceneSpec with_field() {
  SceneSpec spec = named();
  spec.structural_stiffness_n_per_mm = 2.5;
  StructuralModel& field = spec.structural_field.emplace();
  field.stiffness_n_per_mm = 2.5;
  field.gradient_per_mm = {0.01, 0.0, 0.0};
  field.covered_from_mm = {-20.0, -20.0, -20.0};
  field.covered_to_mm = {20.0, 20.0, 20.0};
  return spec;
}

TEST(Scene, HoldsTheTargetWithinTheCompensablePartWhereTheStructureIsSoftest) {
  SceneSpec spec = with_field();
  spec.max_target_stiffness_n_per_mm = 20.0;
  const double softest = 2.5 / 1.2;
  EXPECT_NEAR(softest_structure_n_per_mm(spec), softest, 1e-12);
  spec.target.stiffness_n_per_mm = 0.8 * softest - 0.01;
  EXPECT_TRUE(resolve(spec, rig()));
  spec.target.stiffness_n_per_mm = 0.8 * softest + 0.01;
  EXPECT_FALSE(resolve(spec, rig()));
  spec.structural_field.reset();
  EXPECT_TRUE(resolve(spec, rig())) << "0.8 of 2.5 is more";
}

TEST(Scene, AFieldThatIsWrongIsRefusedByName) {
  ASSERT_TRUE(resolve(with_field(), rig()));
  const double nan = std::numeric_limits<double>::quiet_NaN();
  struct Case {
    const char* named;
    void (*spoil)(StructuralModel&, double);
    double value;
  };
  const auto stiffness = [](StructuralModel& f, double v) { f.stiffness_n_per_mm = v; };
  const auto centre = [](StructuralModel& f, double v) { f.centre_mm.y = v; };
  const auto gradient = [](StructuralModel& f, double v) { f.gradient_per_mm.x = v; };
  const auto curvature = [](StructuralModel& f, double v) { f.curvature_per_mm2[4] = v; };
  const auto from = [](StructuralModel& f, double v) { f.covered_from_mm.z = v; };
  for (const Case& c :
       {Case{"structure.field's stiffness", stiffness, 2.6},
        Case{"structure.field's stiffness", stiffness, nan},
        Case{"structure.field.centre_mm.y", centre, 1001.0},
        Case{"structure.field.gradient_per_mm.x", gradient, nan},
        Case{"structure.field.curvature_per_mm2", curvature, -1.1},
        Case{"structure.field.covered_from_mm.z", from, nan},
        Case{"structure.field's compliance at a corner of what it covers", gradient, 0.051}}) {
    SceneSpec spec = with_field();
    c.spoil(*spec.structural_field, c.value);
    const auto scene = resolve(spec, rig());
    ASSERT_FALSE(scene) << c.named << " = " << c.value;
    EXPECT_EQ(scene.error().what, std::string(c.named) + " is out of range");
    EXPECT_FALSE(scene.error().limit.empty());
  }
}

TEST(Scene, ARigidDeviceNeedsNoCompensation) {
  hal::RigInfo recording = rig();
  recording.device.structural_stiffness_n_per_mm = 0.0;
  EXPECT_FALSE(hapticd::test::value_of(resolve(named(), recording)).structural_compensation);
}

TEST(Scene, IsComposedOfWhatItNeedsAndNothingElse) {
  const auto tap = resolve(named(), rig());
  SceneSpec wall_spec = named();
  wall_spec.kind = SceneKind::kWall;
  const auto wall = resolve(wall_spec, rig());
  ASSERT_TRUE(tap && wall);
  EXPECT_EQ(outline(*tap).hardware, (std::vector<std::string>{"haptic device", "force sensor"}));
  EXPECT_EQ(outline(*wall).hardware, std::vector<std::string>{"haptic device"});
  EXPECT_TRUE(outline(*tap).channels & channel::kMotion);
  EXPECT_FALSE(outline(*wall).channels & channel::kMotion) << "a wall needs no velocity and shows none";
  EXPECT_EQ(wall->guard.sensor_stale_after_ms, 0.0);

  hal::RigInfo blind = rig();
  blind.sensor.model.clear();
  EXPECT_TRUE(compose(*wall, blind));
  EXPECT_EQ(hapticd::test::error_of(compose(*tap, blind)).what,
            "the scene needs a force sensor, the rig has none");
}

TEST(Scene, OutlineAndPipelineAgreeOnTheChannels) {
  for (const SceneKind kind : {SceneKind::kTap1d, SceneKind::kWall}) {
    SceneSpec spec = named();
    spec.kind = kind;
    const auto scene = hapticd::test::value_of(resolve(spec, rig()));
    const auto pipeline = hapticd::test::value_of(compose(scene, rig()));
    const std::uint32_t of_every_scene = channel::kSample | channel::kGuard | channel::kTiming;
    EXPECT_EQ(outline(scene).channels, pipeline->channels() | of_every_scene);
  }
}

TEST(Scene, AModelThatNothingWouldUseIsRefusedByName) {
  SceneSpec spec = named();
  spec.object_model = "breast_phantom";
  const hal::Error refused = hapticd::test::error_of(compose(*resolve(spec, rig()), rig()));
  EXPECT_EQ(refused.what, "the scene has no use for a model");
  EXPECT_EQ(refused.value, "object_model = \"breast_phantom\"");
}

}  // namespace
}  // namespace hapticd::rt
