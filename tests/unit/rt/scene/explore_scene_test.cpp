#include <gtest/gtest.h>

#include <limits>

#include "object_model.h"
#include "rt/scene/compose.h"
#include "tests/support/value_of.h"

namespace hapticd::rt {
namespace {

using namespace test;

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

TEST(Models, AWholeModelIsAccepted) {
  EXPECT_FALSE(check(bench_model()));
  ObjectModel bare;
  EXPECT_FALSE(check(bare)) << "parts that are not there are not wrong";
}

TEST(Models, EveryKeyOutOfRangeIsNamed) {
  struct Case {
    const char* named;
    void (*spoil)(ObjectModel&, double);
    std::vector<double> values;
  };
  for (const Case& c : {
           Case{"max_displacement_mm",
                [](ObjectModel&m, double v) { m.max_displacement_mm = v; },
                {-1.0, 1e4, kNan}},
           Case{"max_force_n", [](ObjectModel&m, double v) { m.max_force_n = v; }, {-1.0, 1e4, kNan}},
           Case{"hunt_crossley.stiffness_n_per_mm_m",
                [](ObjectModel&m, double v) { m.hunt_crossley->parameters.stiffness_n_per_mm_m = v; },
                {0.0, 0.9e-4, 1001.0, kNan}},
           Case{"hunt_crossley.damping_n_s_per_mm_m1",
                [](ObjectModel&m, double v) { m.hunt_crossley->parameters.damping_n_s_per_mm_m1 = v; },
                {-1e-9, 101.0, kNan}},
           Case{"hunt_crossley.exponent",
                [](ObjectModel&m, double v) { m.hunt_crossley->parameters.exponent = v; },
                {0.99, 3.01, kNan}},
           Case{"hunt_crossley.relative_error",
                [](ObjectModel&m, double v) { m.hunt_crossley->relative_error = v; },
                {0.0, 1.01, kNan}},
           Case{"creep.weight",
                [](ObjectModel&m, double v) { m.creep->parameters.weight[2] = v; },
                {-0.1, 1001.0, kNan}},
           Case{"creep.weight's sum",
                [](ObjectModel&m, double v) { m.creep->parameters.weight = {v}; },
                {0.0, 1e-4}},
           Case{"creep.time_s",
                [](ObjectModel&m, double v) { m.creep->parameters.time_s[3] = v; },
                {0.0, -1.0, 1001.0, kNan}},
           Case{"creep.max_force_n",
                [](ObjectModel&m, double v) { m.creep->parameters.max_force_n = v; },
                {0.0, 1001.0, kNan}},
           Case{"creep.displacement_mm, first",
                [](ObjectModel&m, double v) { m.creep->parameters.displacement_mm[0] = v; },
                {0.01, -0.01, kNan}},
           Case{"creep.displacement_mm must rise; knot 5",
                [](ObjectModel&m, double v) { m.creep->parameters.displacement_mm[5] = v; },
                {0.0, -1.0, 1001.0, kNan}},
           Case{"creep.relative_error",
                [](ObjectModel&m, double v) { m.creep->relative_error = v; },
                {0.0, 1.01, kNan}},
           Case{"rod_friction.kinetic",
                [](ObjectModel&m, double v) { m.rod_friction->kinetic = v; },
                {-0.1, 5.1, kNan}},
           Case{"rod_friction.presliding_mm",
                [](ObjectModel&m, double v) { m.rod_friction->presliding_mm = v; },
                {0.0, 21.0, kNan}},
           Case{"rod_friction.viscous_n_s_per_mm",
                [](ObjectModel&m, double v) { m.rod_friction->viscous_n_s_per_mm = v; },
                {-0.1, 1.1, kNan}},
       }) {
    for (const double value : c.values) {
      ObjectModel model = bench_model();
      c.spoil(model, value);
      const auto error = check(model);
      ASSERT_TRUE(error) << c.named << " = " << value;
      EXPECT_EQ(error->what, std::string(c.named) + " is out of range") << value;
      EXPECT_EQ(error->where, "model 'bench_object'");
      EXPECT_FALSE(error->limit.empty());
      const auto scene = hapticd::test::value_of(resolve(explore_scene(Tip::kRod), bench_rig()));
      EXPECT_FALSE(compose(scene, bench_rig(), &model)) << "and it is not composed: " << c.named;
    }
  }
}

TEST(Models, MaxwellSlipElementsAreCheckedAloneAndTogether) {
  EXPECT_FALSE(check(maxwell_slip_model()));
  const auto error_of = [](const auto& spoil) {
    ObjectModel model = maxwell_slip_model();
    spoil(model);
    const auto error = check(model);
    return error ? error->what : std::string();
  };
  for (const double value : {-0.1, 1001.0, kNan}) {
    EXPECT_EQ(error_of([&](ObjectModel& m) { m.rod_friction->maxwell_slip->reach_mm[2] = value; }),
              "rod_friction.maxwell_slip.reach_mm, element 3, is out of range");
  }
  for (const double value : {-0.1, 10'001.0, kNan}) {
    EXPECT_EQ(error_of([&](ObjectModel& m) { m.rod_friction->maxwell_slip->stiffness_per_mm[7] = value; }),
              "rod_friction.maxwell_slip.stiffness_per_mm, element 8, is out of range");
  }
  const std::string level = "rod_friction.kinetic is not the level of the Maxwell-slip elements";
  EXPECT_EQ(error_of([](ObjectModel& m) { m.rod_friction->kinetic *= 1.01; }), level);
  EXPECT_EQ(error_of([](ObjectModel& m) { m.rod_friction->maxwell_slip.emplace(); }), level) << "none at all";
  EXPECT_EQ(error_of([](ObjectModel& m) { m.bearing_friction = m.rod_friction; }),
            "a ball bearing's friction has no Maxwell-slip elements");
}

TEST(ExploreScene, NamesEveryPartOfTheModelThatIsMissing) {
  struct Case {
    const char* name;
    SceneSpec spec;
    std::vector<std::string> needs;
  };
  SceneSpec recursive_rod = explore_scene(Tip::kRod);
  recursive_rod.explore.displacement = DisplacementEstimator::kRecursive;
  SceneSpec recursive_bearing = explore_scene(Tip::kBallBearing);
  recursive_bearing.explore.displacement = DisplacementEstimator::kRecursive;
  const std::string creep = "creep law of 'bench_object'";
  const std::string hunt_crossley = "Hunt-Crossley law of 'bench_object'";
  const std::string friction = "friction of the rod of 'bench_object'";
  for (const Case& c :
       {Case{"rod", explore_scene(Tip::kRod), {creep, friction}},
        Case{"bearing", explore_scene(Tip::kBallBearing), {creep}},
        Case{"as published", dissertation_scene(Tip::kRod), {hunt_crossley, friction}},
        Case{"as published, bearing", dissertation_scene(Tip::kBallBearing), {hunt_crossley}},
        Case{"recursive rod", recursive_rod, {friction}}, Case{"recursive bearing", recursive_bearing, {}}}) {
    const auto scene = resolve(c.spec, bench_rig());
    ASSERT_TRUE(scene) << c.name;
    EXPECT_EQ(needed_models(*scene), c.needs) << c.name;
    EXPECT_EQ(outline(*scene).models, c.needs) << c.name;
    const ObjectModel whole = bench_model();
    EXPECT_TRUE(needed_models(*scene, &whole).empty()) << c.name;
    EXPECT_TRUE(compose(*scene, bench_rig(), &whole)) << c.name;

    ObjectModel bare;
    bare.name = "bench_object";
    for (const ObjectModel* lacking : {static_cast<const ObjectModel*>(nullptr), &std::as_const(bare)}) {
      const auto composed = compose(*scene, bench_rig(), lacking);
      if (c.needs.empty()) {
        EXPECT_TRUE(composed) << c.name;
        continue;
      }
      ASSERT_FALSE(composed) << c.name;
      for (const std::string& part : c.needs) {
        EXPECT_NE(composed.error().what.find(part), std::string::npos) << composed.error().text();
      }
      EXPECT_FALSE(composed.error().remedy.empty());
    }
    // One part missing: that one is named and no other.
    for (const std::string& part : c.needs) {
      ObjectModel without = bench_model();
      if (part == creep) without.creep.reset();
      if (part == hunt_crossley) without.hunt_crossley.reset();
      if (part == friction) without.rod_friction.reset();
      const auto composed = compose(*scene, bench_rig(), &without);
      ASSERT_FALSE(composed) << c.name << " without " << part;
      for (const std::string& other : c.needs) {
        EXPECT_EQ(composed.error().what.find(other) != std::string::npos, other == part);
      }
    }
  }
}

TEST(ExploreScene, KeysOutOfRangeAreNamed) {
  struct Case {
    const char* named;
    void (*spoil)(SceneSpec&, double);
    std::vector<double> values;
  };
  for (const Case& c :
       {Case{
            "control.lead_ms", [](SceneSpec&s, double v) { s.compensation.lead_ms = v; }, {-1.0, 51.0, kNan}},
        Case{"structure.cutoff_hz",
             [](SceneSpec&s, double v) { s.explore.deflection_cutoff_hz = v; },
             {-1.0, 401.0, kNan}},
        Case{"contact.force_noise_n",
             [](SceneSpec&s, double v) { s.explore.force_noise_n = v; },
             {0.0, 1.1, kNan}},
        Case{"tool.gravity_at_bias, its length",
             [](SceneSpec&s, double v) {
               s.explore.gravity_at_bias = {0.0, 0.0, v};
             },
             {0.0, 1e7, kNan}},
        Case{"tool.mass_g", [](SceneSpec&s, double v) { s.tool_mass_g = v; }, {-1.0, 501.0, kNan}},
        Case{"target's stiffness",
             [](SceneSpec&s, double v) {
               s.max_target_stiffness_n_per_mm = 5.0;
               s.target = linear_target(v);
             },
             {5.1, 900.0}}}) {
    for (const double value : c.values) {
      SceneSpec spec = explore_scene(Tip::kRod);
      c.spoil(spec, value);
      const auto scene = resolve(spec, bench_rig());
      ASSERT_FALSE(scene) << c.named << " = " << value;
      EXPECT_EQ(scene.error().what, std::string(c.named) + " is out of range");
      EXPECT_EQ(scene.error().where, "scene 'explore_rod'");
    }
  }
}

TEST(ExploreScene, APowerLawTargetIsJudgedDeepIn) {
  SceneSpec spec = explore_scene(Tip::kRod);
  spec.max_target_stiffness_n_per_mm = 20.0;
  spec.target.kind = TargetLaw::Kind::kHuntCrossley;
  spec.target.hunt_crossley = {0.3, 0.0, 2.0};  // 12 N/mm at 20 mm
  EXPECT_TRUE(resolve(spec, bench_rig()));
  spec.target.hunt_crossley.exponent = 3.0;  // 360 N/mm
  EXPECT_FALSE(resolve(spec, bench_rig()));
}

TEST(ExploreScene, OnlySpatialScenesTakeLawsAndModels) {
  SceneSpec tap;
  tap.name = "tap";
  tap.target.kind = TargetLaw::Kind::kDisplacementProfile;
  tap.target.knot_count = 1;
  EXPECT_EQ(hapticd::test::error_of(resolve(tap, bench_rig())).what, "target.law is out of range");
}

}  // namespace
}  // namespace hapticd::rt
