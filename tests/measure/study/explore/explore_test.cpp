#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <numbers>
#include <set>
#include <sstream>
#include <string>
#include <tuple>
#include <vector>

#include "rt/signal/vector.h"
#include "server/scene/scene_file.h"
#include "tests/measure/report/quantile.h"
#include "tests/measure/study/common/explore_study.h"
#include "tests/measure/study/common/hands.h"
#include "tests/measure/study/common/plant.h"
#include "tests/measure/study/common/scenes.h"
#include "tests/measure/study/common/shadow.h"
#include "tests/measure/study/explore/stroke_judge.h"
#include "tests/measure/study/uncertainty/displacement_coverage.h"
#include "tests/support/value_of.h"

namespace hapticd::sim {

void PrintTo(Plant plant, std::ostream* out) {
  *out << name_of(plant);
}

}  // namespace hapticd::sim

namespace hapticd::study {
namespace {

sim::HandProgram strokes(double force_n, double speed_mm_per_s) {
  sim::HandProgram hand;
  hand.kind = sim::HandProgram::Kind::kStroke;
  hand.force_n = force_n;
  hand.speed_mm_per_s = speed_mm_per_s;
  hand.stroke_length_mm = 40.0;
  hand.repetitions = -1;
  hand.approach_mm_per_s = 40.0;
  hand.force_rate_n_per_s = 6.0;
  return hand;
}

TEST(Uncertainty, OfTheDisplacementIsTrueOnAFamilyThatItWasNotChosenOn) {
  const OnPlant general(sim::Plant::kGeneral);
  Coverage pressing, letting_go;
  for (const std::string object : {"sponge_cut", "rubber_ball_3d"}) {
    const StrokeCoverage found = stroke_coverage(object, rt::Tip::kRod, {3.0, 5.0}, {80.0});
    pressing.add(found.pressing);
    letting_go.add(found.letting_go);
  }
  EXPECT_GT(pressing.share(2), 0.85);
  EXPECT_GT(letting_go.share(2), 0.85);
  EXPECT_LT(pressing.share(1), 0.95) << "nor is it far too large";
}

TEST(Coverage, CountsWhatIsWithinOneAndTwo) {
  Coverage coverage;
  for (const double error : {0.5, -0.9, 1.5, -1.9, 3.0}) coverage.add(error, 1.0);
  coverage.add(1.0, 0.0);  // an error without a deviation is never within it
  EXPECT_DOUBLE_EQ(coverage.share(1), 2.0 / 6.0);
  EXPECT_DOUBLE_EQ(coverage.share(2), 4.0 / 6.0);
}

TEST(StrokeJudge, TellsALimitCycleFromASlowMotion) {
  const auto swing = [](double hz, double peak_to_peak_mm) {
    StrokeJudge judge(1000.0);
    for (int i = 0; i < 2000; ++i) {
      judge.add(5.0 + 0.5 * peak_to_peak_mm * std::sin(2e-3 * std::numbers::pi * hz * i));
    }
    return judge.swing_mm();
  };
  EXPECT_GT(swing(20.0, 1.0), 0.8);
  EXPECT_GT(swing(60.0, 1.0), 0.9);
  EXPECT_LT(swing(0.5, 2.0), 0.2);
}

TEST(StrokeJudge, PassesOverTheTurnOfAStroke) {
  StrokeJudge judge(1000.0);
  for (int i = 0; i < 2000; ++i) judge.add(i % 1000 < 20 ? 3.0 : 5.0);
  EXPECT_LT(judge.swing_mm(), 0.2);
}

using ExploredCase = std::tuple<std::string, sim::Plant, bool>;  // object, family, by the shipped model

class Explored : public testing::TestWithParam<ExploredCase> {
 protected:
  const std::string& object() const { return std::get<0>(GetParam()); }
  rt::ObjectModel model() const {
    return std::get<2>(GetParam()) ? shipped_model(object()) : identified(object()).model;
  }

 private:
  OnPlant family_{std::get<1>(GetParam())};
};
std::string name_of_explored(const testing::TestParamInfo<ExploredCase>& info) {
  const auto& [object, plant, shipped] = info.param;
  return object + "_" + sim::name_of(plant) + (shipped ? "_shipped" : "_identified");
}
/// Shipped models stand for identified ones on the separable family: the next test asserts that they agree.
std::vector<ExploredCase> explored_cases() {
  std::vector<ExploredCase> all;
  for (const std::string& object : explored_objects()) {
    all.emplace_back(object, sim::Plant::kSeparable, true);
    all.emplace_back(object, sim::Plant::kGeneral, true);
    all.emplace_back(object, sim::Plant::kGeneral, false);
  }
  return all;
}
INSTANTIATE_TEST_SUITE_P(Objects, Explored, testing::ValuesIn(explored_cases()), name_of_explored);

TEST(ExploredModels, EveryShippedOneIsWhatTheServiceIdentifies) {
  std::set<std::string> names;
  for (const auto& file : std::filesystem::directory_iterator(HAPTICD_MODELS)) {
    if (file.path().extension() == ".toml") names.insert(file.path().stem());
  }
  EXPECT_EQ(names, std::set<std::string>(explored_objects().begin(), explored_objects().end()));
  for (const std::string& name : names) {
    const rt::ObjectModel built_in = shipped_model(name);
    const rt::ObjectModel fresh = identify(name).model;
    EXPECT_EQ(built_in.identified_on, fresh.identified_on);
    ASSERT_TRUE(built_in.rod_friction && fresh.rod_friction) << name;
    EXPECT_NEAR(built_in.rod_friction->kinetic, fresh.rod_friction->kinetic, 0.01) << name;
    EXPECT_NEAR(built_in.rod_friction->presliding_mm, fresh.rod_friction->presliding_mm,
                0.1 * fresh.rod_friction->presliding_mm)
        << name;
    EXPECT_NEAR(built_in.rod_friction->exponent, fresh.rod_friction->exponent, 0.05) << name;
    ASSERT_EQ(built_in.hunt_crossley.has_value(), fresh.hunt_crossley.has_value()) << name;
    if (fresh.hunt_crossley) {
      EXPECT_NEAR(built_in.hunt_crossley->parameters.exponent, fresh.hunt_crossley->parameters.exponent, 0.02)
          << name;
    }
    ASSERT_TRUE(built_in.creep && fresh.creep) << name;
    const rt::CreepLaw of_file(built_in.creep->parameters, 1000.0);
    const rt::CreepLaw of_now(fresh.creep->parameters, 1000.0);
    for (const double force_n : {0.5, 2.0, 8.0}) {
      const double x = of_now.curve(force_n).displacement_mm;
      EXPECT_NEAR(of_file.curve(force_n).displacement_mm, x, 0.03 * x) << name << ", " << force_n << " N";
    }
  }
}

void expect_target_at_the_hand(const ExploredCase& explored, const rt::ObjectModel& known) {
  // The general family relaxes by another law than the one that is identified. A shipped model is of the
  // separable object, so on the general one it is another object's.
  const auto& [object, plant, shipped] = explored;
  const double bound = plant == sim::Plant::kSeparable ? 0.05 : shipped ? 0.25 : 0.12;
  for (const double target : {0.3, 0.8}) {
    rt::SceneSpec scene = explore_scene(rt::Tip::kBallBearing);
    scene.target = rt::linear_target(target);
    VirtualRun run(explore_rig("phantom_1_5_high_force", object, "ball_bearing"), scene, true, &known);
    run.set_hand(pressing(4.0));
    double force_n = 0.0;
    double depth_mm = 0.0;
    while (run.time_s() < 8.0) {
      run.step();
      if (run.time_s() < 7.0) continue;
      force_n += run.hand_force_n();
      depth_mm += run.truth().displacement_mm;
    }
    EXPECT_NEAR(force_n / depth_mm, target, bound * target) << target;
  }
}

/// The scenes that explore, from their files.
std::vector<rt::SceneSpec> shipped_explore_scenes() {
  std::vector<rt::SceneSpec> scenes;
  for (const auto& file : std::filesystem::directory_iterator(HAPTICD_SCENES)) {
    if (file.path().extension() != ".toml") continue;
    std::stringstream text;
    text << std::ifstream(file.path()).rdbuf();
    rt::SceneSpec scene = test::value_of(server::parse_scene(text.str(), file.path().string()));
    if (scene.kind == rt::SceneKind::kExplore) scenes.push_back(std::move(scene));
  }
  return scenes;
}

void expect_scenes_to_hold_strokes(const std::string& object, const rt::ObjectModel& known) {
  constexpr double kDirectionGoalDeg = 8.0;
  const std::vector<rt::SceneSpec> scenes = shipped_explore_scenes();
  EXPECT_GE(scenes.size(), 4U);
  for (const rt::SceneSpec& scene : scenes) {
    const bool rod = scene.tip == rt::Tip::kRod;
    VirtualRun run = unrendered(explore_rig("phantom_1_5_high_force", object, rod ? "rod" : "ball_bearing"));
    Shadow shadow(run.info(), scene, known);
    sim::HandProgram hand = strokes(4.0, 100.0);
    hand.tilt_deg = 10.0;
    run.set_hand(hand);
    std::vector<double> angles_deg;
    std::vector<double> errors;
    while (run.time_s() < 7.0) {
      run.step();
      shadow.watch(run.sample());
      const hal::TruthSample& truth = run.truth();
      if (!truth.in_contact || !shadow.record().in_contact || truth.displacement_mm < 0.2) continue;
      const double cosine = std::clamp(dot(shadow.record().normal, truth.outward_normal), -1.0, 1.0);
      angles_deg.push_back(std::acos(cosine) * 180.0 / std::numbers::pi);
      errors.push_back(std::abs(shadow.record().displacement_mm / truth.displacement_mm - 1.0));
    }
    ASSERT_GT(angles_deg.size(), 4000U) << scene.name;
    EXPECT_LT(report::quantile(angles_deg, 0.95), rod ? kDirectionGoalDeg : 0.5 * kDirectionGoalDeg)
        << scene.name;
    // The goal is 2 %; the figures say how far it is.
    EXPECT_LT(report::quantile(errors, 0.5), 0.05) << scene.name;
  }
}

// One test, since each case runs in a process that identifies its object first.
TEST_P(Explored, TheHandFeelsTheTargetAndShippedScenesHoldDirectionAndDisplacementThroughStrokes) {
  const rt::ObjectModel known = model();
  expect_target_at_the_hand(GetParam(), known);
  expect_scenes_to_hold_strokes(object(), known);
}

/// Swing of the stroking tip under a scene at a target; infinite if the guard ended an oscillation.
double swing_mm(const std::string& object, rt::SceneSpec scene, const rt::ObjectModel& model, double target) {
  scene.target = rt::linear_target(target);
  VirtualRun run(explore_rig("phantom_1_5_high_force", object, "ball_bearing"), scene, true, &model);
  run.set_hand(strokes(3.0, 80.0));
  while (run.time_s() < 4.0) run.step();
  StrokeJudge judge(1000.0);
  while (run.time_s() < 7.0) {
    run.step();
    judge.add(run.truth().displacement_mm);
  }
  if (run.record().guard_fault == rt::GuardFault::kOscillation) return HUGE_VAL;
  return judge.swing_mm();
}

TEST(ExploredStability, HoldsWhereThePublishedPipelineOscillates) {
  const IdentificationResult& foam = identified("foam_ball_3d");
  EXPECT_LT(swing_mm("foam_ball_3d", explore_scene(rt::Tip::kBallBearing), foam.model, 1.5), 0.5);
  EXPECT_GT(swing_mm("foam_ball_3d", dissertation_scene(rt::Tip::kBallBearing), foam.dissertation, 1.5), 2.0);
}

TEST(ExploredStability, AStiffBallThatIsSoftenedMuchIsStrokedWithoutASwing) {
  // Pulled at with 10 N and more along an estimated normal, which the pull itself must not turn.
  rt::SceneSpec scene = explore_scene(rt::Tip::kRod);
  scene.target = rt::linear_target(0.3);
  for (const char* device : {"phantom_1_0", "phantom_1_5_high_force"}) {
    for (const double speed : {20.0, 60.0}) {
      for (const double force : {2.0, 4.0}) {
        VirtualRun run(explore_rig(device, "rubber_ball_3d", "rod"), scene, true,
                       &identified("rubber_ball_3d").model);
        sim::HandProgram hand = strokes(force, speed);
        hand.stroke_length_mm = 30.0;
        hand.approach_mm_per_s = 30.0;
        hand.force_rate_n_per_s = 2.0;
        run.set_hand(hand);
        double max_n = 0.0;
        bool latched = false;
        while (run.time_s() < 10.0) {
          run.step();
          max_n = std::max(max_n, rt::norm(run.record().device_command_n));
          latched = latched || run.record().guard_state == rt::GuardState::kLatched;
        }
        EXPECT_FALSE(latched) << device << ", " << speed << " mm/s, " << force << " N";
        EXPECT_GT(max_n, 3.0) << "the device does pull";
      }
    }
  }
}

TEST(ExploredStability, IsLostInTheEnd) {
  // The judge must be able to fail: no loop with these delays holds a target of 60 times the object. The
  // evidence would keep the force small.
  const IdentificationResult& foam = identified("foam_ball_3d");
  rt::SceneSpec scene = explore_scene(rt::Tip::kBallBearing);
  scene.contact.evidence.required = false;
  EXPECT_GT(swing_mm("foam_ball_3d", scene, foam.model, 20.0), 0.5);
}

TEST(ExploredContact, IsRegainedAfterABounce) {
  // A bare weight bounces on a hard target; once it rests, it is rendered again. From 1.05 N/mm on this arm
  // swings so much in some bounces that the path contradicts the reaction, and from 1.2 N/mm on always; then
  // status asks to lift the tool.
  for (const double target : {0.5, 0.8, 0.9, 1.0}) {
    rt::SceneSpec scene = explore_scene(rt::Tip::kBallBearing);
    scene.target = rt::linear_target(target);
    VirtualRun run(explore_rig("phantom_1_0", "rubber_ball_3d", "ball_bearing"), scene, true,
                   &identified("rubber_ball_3d").model);
    sim::HandProgram weight;
    weight.kind = sim::HandProgram::Kind::kWeight;
    run.set_hand(weight);
    while (run.time_s() < 8.0) run.step();
    ASSERT_TRUE(run.truth().in_contact) << target;
    EXPECT_TRUE(run.record().in_contact) << target;
    EXPECT_NEAR(run.record().displacement_mm, run.truth().displacement_mm, 0.1 * run.truth().displacement_mm)
        << target;
  }
}

}  // namespace
}  // namespace hapticd::study
