#include "server/scene/scene_file.h"

#include <gtest/gtest.h>

#include <initializer_list>
#include <optional>
#include <random>
#include <tuple>
#include <vector>

#include "rt/signal/vector.h"
#include "server/scene/scene_inclusions.h"
#include "server/scene/scene_library.h"
#include "tests/support/refusals.h"
#include "tests/support/temporary_folder.h"
#include "tests/support/value_of.h"

namespace hapticd::server {
namespace {

/// Every number that the file of such a scene says, by reference. The bindings name all members, so a new one
/// fails to compile here until the scene file can say it.
std::vector<double*> numbers_of(rt::SceneSpec& spec) {
  auto& [name, kind, description, tip, object_model, station, corrected_poses, axis, mass, contact, wall,
         ball, map, target, max_target, ramp, max_change, structure_compensated, structural, structural_field,
         explore, inclusions, friction_target, transient, fixture, watch, control, seeks_gain, compensation,
         guard] = spec;
  auto& [method, threshold, ratio, release_time, clearance, quiet_time, arming_time, evidence, zero_bound] =
      contact;
  auto& [evidence_required, unexplained, lowest_stiffness] = evidence;
  auto& [law, proportional, derivative] = control;
  auto& [force, rate, power, stale, resume, fall, gap, real_object, tool] = guard;
  auto& [direction, displacement, contact_law, feel, release, modulated, passivity, cutoff, noise, gravity,
         mounting, tip_to_centre] = explore;
  auto& [lead, reaction_lead, back_drive] = compensation;
  auto& [target_kind, stiffness, power_law, knots, knot_count, target_axis] = target;
  auto& [power_stiffness, power_damping, exponent] = power_law;
  static_cast<void>(name), static_cast<void>(description), static_cast<void>(tip);
  static_cast<void>(corrected_poses);  // compared below
  // Nothing that a file may say.
  static_cast<void>(seeks_gain), static_cast<void>(real_object), static_cast<void>(tool);
  static_cast<void>(object_model), static_cast<void>(station), static_cast<void>(structure_compensated),
      static_cast<void>(method), static_cast<void>(evidence_required);
  static_cast<void>(release_time), static_cast<void>(quiet_time), static_cast<void>(arming_time);
  static_cast<void>(law), static_cast<void>(direction), static_cast<void>(displacement);
  static_cast<void>(contact_law), static_cast<void>(feel), static_cast<void>(release);
  static_cast<void>(modulated), static_cast<void>(friction_target), static_cast<void>(transient);
  static_cast<void>(fixture), static_cast<void>(watch), static_cast<void>(ball);  // compared below
  static_cast<void>(passivity), static_cast<void>(back_drive), static_cast<void>(exponent);
  std::vector<double*> numbers{&mass,         &max_target, &ramp,  &max_change, &structural,
                               &proportional, &derivative, &force, &rate,       &power,
                               &stale,        &resume,     &fall,  &gap};
  const auto add = [&numbers](std::initializer_list<double*> more) {
    numbers.insert(numbers.end(), more.begin(), more.end());
  };
  if (kind == rt::SceneKind::kWall) add({&wall});
  if (kind != rt::SceneKind::kWall) {
    if (!reaction_lead) reaction_lead.emplace();
    add({&*reaction_lead});
  }
  if (kind != rt::SceneKind::kWall)
    add({&threshold, &ratio, &clearance, &unexplained, &lowest_stiffness, &zero_bound});
  if (kind != rt::SceneKind::kExplore) add({&axis.x, &axis.y, &axis.z});
  if (kind == rt::SceneKind::kExplore) {
    add({&lead, &cutoff, &noise, &gravity.x, &gravity.y, &gravity.z});
    if (!mounting) mounting.emplace();
    auto& [turn, bias] = *mounting;
    add({&turn.x, &turn.y, &turn.z, &bias.x, &bias.y, &bias.z});
    if (!tip_to_centre) tip_to_centre.emplace();
    add({&tip_to_centre->x, &tip_to_centre->y, &tip_to_centre->z});
    for (rt::InclusionParameters& one : inclusions) {
      auto& [variant, model, place, surface, response, deepest, attenuation, approach, friction, presliding,
             moved, object_centre] = one;
      if (!object_centre) object_centre.emplace();
      add({&moved[0], &moved[1], &object_centre->x, &object_centre->y, &object_centre->z});
      auto& [added_stiffness, added_damping, added_exponent] = response;
      // Those whose ranges do not contain 0.01 … 0.99 are compared below.
      static_cast<void>(variant), static_cast<void>(model), static_cast<void>(deepest),
          static_cast<void>(attenuation);
      static_cast<void>(added_exponent), static_cast<void>(approach);
      for (hal::Vector3* v : {&place, &surface}) add({&v->x, &v->y, &v->z});
      add({&added_stiffness, &added_damping, &friction, &presliding});
    }
  }
  if (structural_field) {
    auto& [at_centre, centre, gradient, curvature, from, to] = *structural_field;
    static_cast<void>(at_centre);  // is `structural`
    for (hal::Vector3* v : {&centre, &gradient, &from, &to}) add({&v->x, &v->y, &v->z});
    for (double& h : curvature) add({&h});
  }
  switch (target_kind) {
    case rt::TargetLaw::Kind::kLinear:
      add({&stiffness});
      break;
    case rt::TargetLaw::Kind::kHuntCrossley:
      add({&power_stiffness, &power_damping});
      break;
    case rt::TargetLaw::Kind::kPositionProfile:
      add({&target_axis.x, &target_axis.y, &target_axis.z});
      [[fallthrough]];
    case rt::TargetLaw::Kind::kDisplacementProfile:
      for (std::uint32_t i = 0; i < knot_count; ++i) add({&knots[i].at_mm, &knots[i].stiffness_n_per_mm});
      break;
  }
  return numbers;
}

/// Words of a file, and its numbers that are not in 0.01 … 0.99.
auto words_of(const rt::SceneSpec& spec) {
  const rt::SceneSpec& s = spec;
  return std::make_tuple(
      s.name, s.kind, s.description, s.tip, s.object_model, s.corrected_poses, s.structural_compensation,
      s.contact.method, s.contact.release_time_ms, s.contact.quiet_time_ms, s.contact.arming_time_ms,
      s.controller.law, s.explore.direction, s.explore.displacement, s.explore.law, s.explore.friction_feel,
      s.explore.release, s.explore.passivity, s.explore.modulated, s.compensation.back_drive, s.target.kind,
      s.target.knot_count, s.target.hunt_crossley.exponent, s.wall_ball, s.wall_map, s.fixture, s.watch);
}

/// Numbers of the parts that a scene may have or not.
std::vector<std::optional<double>> parts_of(const rt::SceneSpec& spec) {
  std::vector<std::optional<double>> numbers;
  const auto add = [&numbers](std::initializer_list<std::optional<double>> more) {
    numbers.insert(numbers.end(), more.begin(), more.end());
  };
  if (spec.structural_field) add({spec.structural_field->stiffness_n_per_mm});
  for (const rt::InclusionParameters& one : spec.inclusions) {
    add({static_cast<double>(one.variant), one.max_displacement_mm, one.approach, one.attenuation,
         one.response.exponent});
  }
  if (spec.transient) {
    const rt::TransientParameters& transient = *spec.transient;
    add({static_cast<double>(transient.target.size()), static_cast<double>(transient.real.size()),
         transient.target.at(0).decay_per_s, transient.max_force_n, transient.grip.grip_damping_n_s_per_mm});
  }
  if (spec.friction_target) add({spec.friction_target->scale, spec.friction_target->coefficient});
  return numbers;
}

/// One of a scene's words, by the round's number.
template <class E>
E turn(int round, int period, std::initializer_list<E> values) {
  return *(values.begin() + (round / period) % static_cast<int>(values.size()));
}

hal::Result<rt::SceneSpec> read_scene(const std::string& toml) {
  return parse_scene(toml, "scene text");
}

TEST(SceneFile, WhatIsWrittenReadsBackBitForBit) {
  std::mt19937_64 random(1);
  std::uniform_real_distribution<double> fraction(0.01, 0.99);  // inside every range
  for (int round = 0; round < 100; ++round) {
    rt::SceneSpec spec;
    spec.name = "round-trip_1";
    spec.kind = turn(round, 1, {rt::SceneKind::kTap1d, rt::SceneKind::kExplore, rt::SceneKind::kWall});
    const bool wall = spec.kind == rt::SceneKind::kWall;
    spec.description = "quotes \" and \\ and\nlines and ε and \x01";
    spec.tip = turn(round, 2, {rt::Tip::kBallBearing, rt::Tip::kRod});
    spec.object_model = "sponge";
    spec.corrected_poses = round % 2 == 1;
    spec.structural_compensation = round % 3 == 0;
    if (!wall) {
      spec.contact.method =
          turn(round, 2, {rt::ContactMethod::kMatchedInertia, rt::ContactMethod::kFilteredAcceleration});
      spec.contact.release_time_ms = 1.0 + round;
      spec.contact.quiet_time_ms = 1.0 + 3.0 * round;
      spec.contact.arming_time_ms = 1.0 + 7.0 * round;
    }
    if (spec.kind == rt::SceneKind::kExplore) {
      using Kind = rt::TargetLaw::Kind;
      spec.explore.direction =
          turn(round, 3, {rt::DirectionMethod::kTracked, rt::DirectionMethod::kPublished});
      spec.explore.displacement =
          turn(round, 3,
               {rt::DisplacementEstimator::kFused, rt::DisplacementEstimator::kInverse,
                rt::DisplacementEstimator::kRecursive});
      spec.explore.law = turn(round, 6, {rt::ContactLawKind::kCreep, rt::ContactLawKind::kHuntCrossley});
      spec.explore.friction_feel = turn(round, 6, {rt::FrictionFeel::kKept, rt::FrictionFeel::kCancelled});
      spec.explore.release =
          turn(round, 9, {rt::ReleaseMethod::kFollow, rt::ReleaseMethod::kFade, rt::ReleaseMethod::kCut});
      spec.explore.passivity = turn(round, 9, {true, false});
      spec.explore.modulated = turn(round, 6, {true, false});
      spec.inclusions.resize(static_cast<std::size_t>(round) % 9);
      for (rt::InclusionParameters& one : spec.inclusions) {
        one.variant = turn(round, 9, {rt::InclusionVariant::kEnergy, rt::InclusionVariant::kPublished});
        one.max_displacement_mm = 1.0 + 90.0 * fraction(random);
        one.approach = 0.9 * fraction(random);
        one.attenuation = 2.0 + 10.0 * fraction(random);
        one.response.exponent = 1.0 + 3.0 * fraction(random);
      }
      if (round % 2 == 0) spec.friction_target.emplace().scale = 0.2 + fraction(random);
      if (round % 3 == 1) {
        rt::TransientParameters& transient = spec.transient.emplace();
        transient.max_force_n = fraction(random);
        transient.target.resize(1 + static_cast<std::size_t>(round / 3) % 3);
        transient.real.resize(static_cast<std::size_t>(round / 3) % 4);
        for (auto* modes : {&transient.target, &transient.real}) {
          for (rt::TransientMode& mode : *modes) {
            mode = {10.0 + fraction(random), 30.0 + fraction(random), fraction(random)};
          }
        }
        transient.grip = {10.0 + fraction(random), 50.0 + fraction(random), 1.0 + fraction(random),
                          fraction(random), fraction(random)};
      }
      if (round % 4 == 1) spec.friction_target.emplace().coefficient = 0.2 + fraction(random);
      spec.target.kind =
          turn(round, 12,
               {Kind::kLinear, Kind::kHuntCrossley, Kind::kDisplacementProfile, Kind::kPositionProfile});
      if (spec.target.kind == Kind::kHuntCrossley) {
        spec.target.hunt_crossley.exponent = 1.0 + fraction(random);
      }
      if (spec.target.kind >= Kind::kDisplacementProfile) {
        spec.target.knot_count = 1 + static_cast<std::uint32_t>(round) % rt::TargetLaw::kMaxKnots;
      }
    }
    if (round % 2 == 0) {
      spec.fixture = {0.05 + 0.9 * fraction(random), 0.001 + 0.004 * fraction(random),
                      0.1 + 3.0 * fraction(random),  20.0 * fraction(random),
                      50.0 * fraction(random),       2.0 + 40.0 * fraction(random)};
    }
    if (wall && round % 2 == 0) {
      spec.wall_ball = {{fraction(random), fraction(random), fraction(random)}, 2.0 + fraction(random)};
    }
    if (wall && round % 2 == 1) {
      spec.wall_map = {{fraction(random), fraction(random)}, 1.0 + fraction(random), 2, {}};
      for (int i = 0; i < 6; ++i) spec.wall_map->heights_mm.push_back(fraction(random));
    }
    if (round % 3 != 0) {
      spec.watch = {2000.0 * fraction(random), 500.0 * fraction(random), 2000.0 * fraction(random),
                    static_cast<std::uint32_t>(round), 1e4 * fraction(random)};
    }
    if (spec.kind != rt::SceneKind::kWall) spec.compensation.back_drive = turn(round, 6, {true, false});
    spec.controller.law = round % 2 == 0 ? rt::ControlLaw::kClosedLoop : rt::ControlLaw::kOpenLoop;
    if (round % 2 == 0) spec.structural_field.emplace();
    for (double* number : numbers_of(spec)) *number = fraction(random);
    spec.target.hunt_crossley.damping_n_s_per_mm_m1 *= rt::kMaxTargetDampingNsPerMm;  // its range
    if (spec.structural_field) spec.structural_field->stiffness_n_per_mm = spec.structural_stiffness_n_per_mm;

    const std::string text = write_scene(spec);
    auto again = test::value_of(parse_scene(text, "written"));
    const auto before = numbers_of(spec);
    const auto after = numbers_of(again);
    ASSERT_EQ(before.size(), after.size());
    for (std::size_t i = 0; i < before.size(); ++i) EXPECT_EQ(*before[i], *after[i]) << "number " << i;
    EXPECT_EQ(words_of(again), words_of(spec));
    EXPECT_EQ(parts_of(again), parts_of(spec));
    EXPECT_EQ(write_scene(again), text);
  }
}

TEST(SceneFile, AFieldHasTheStiffnessOfItsCentre) {
  const auto scene = test::value_of(read_scene(
      "name = \"x\"\n[structure]\nstiffness_n_per_mm = 2.5\n[structure.field]\ngradient_per_mm = [0.001, 0, "
      "0]\n"));
  EXPECT_EQ(scene.structural_field->stiffness_n_per_mm, 2.5);
  EXPECT_EQ(scene.structural_field->gradient_per_mm.x, 0.001);
}

TEST(SceneFile, ATransientMayBeAMaterial) {
  const auto wood =
      test::value_of(read_scene("name = \"x\"\nkind = \"explore\"\n[transient]\nmaterial = \"wood\"\n"));
  ASSERT_EQ(wood.transient->target.size(), 1U);
  EXPECT_EQ(wood.transient->target[0].frequency_hz, 100.0);
}

TEST(SceneFile, ARefusalHasFivePartsAndACode) {
  using enum hal::ErrorCode;
  const auto scene = read_scene("name = \"x\"\n[target]\nstifness = 0.5\n");
  ASSERT_FALSE(scene);
  test::expect_same(scene.error(),
                    {"unknown key 'stifness' in [target]", "scene text, line 3", "",
                     "law, stiffness_n_per_mm, max_stiffness_n_per_mm, ramp_s, max_change_n_per_s",
                     "did you mean 'stiffness_n_per_mm'?", kUnknownKey});
}

TEST(SceneFile, WhatIsWrongIsRefusedByKeyAndLine) {
  using enum hal::ErrorCode;
  const std::string tap = "name = \"x\"\n";
  const std::string explore = tap + "kind = \"explore\"\n";
  test::expect_refusals(
      {
          {tap + "[contcat]\nthreshold_n = 0.5\n", "'contcat'", kUnknownKey, 2},
          {tap + "[structure]\nfield = { gradient_per_mm = [0.001, 0, 0] }\n", "'structure.field'",
           kMissingKey, 3},
          {tap + "[structure]\nstiffness_n_per_mm = 2.5\nfield = { gradient = [0.001, 0, 0] }\n",
           "'gradient' in [structure.field]", kUnknownKey, 4},
          {tap + "[target]\nstiffness_n_per_mm = -0.5\n", "'target.stiffness_n_per_mm'", kOutOfRange, 3,
           "0 … 1000 N/mm"},
          {tap + "press_axis = [0, 0]\n", "'press_axis'", kWrongType, 2, "-1 … 1"},
          {tap + "[contact]\nthreshold_n = inf\n", "'contact.threshold_n'", kNotFinite, 3, "0 … 5 N"},
          {explore + "[tool]\ntip = \"ball_baering\"\n", "'tool.tip'", kUnknownWord, 4},
          {explore + "[displacement]\nestimater = \"fused\"\n", "'estimater' in [displacement]", kUnknownKey,
           4},
          {explore + "[release]\nmethod = \"cutt\"\n", "'release.method'", kUnknownWord, 4,
           "follow, fade, cut"},
          {explore + "[passivity]\ncontrol = 1\n", "'passivity.control'", kWrongType, 4},
          {explore + "[target]\nlaw = \"displacement_profile\"\nprofile = [[0, 1], [2]]\n",
           "'target.profile'", kWrongType, 5, "1 … 16 pairs of numbers [-1000 … 1000 mm"},
          {explore + "[target]\nlaw = \"displacement_profile\"\nprofile = [[0, 1], [2, -1]]\n",
           "'target.profile[1][1]'", kOutOfRange, 5},
          {explore + "[friction_target]\nscale = 0.1\n", "'friction_target.scale'", kOutOfRange, 4,
           "0.15 … 3"},
          {explore + "[friction_target]\ncoefficient = nan\n", "'friction_target.coefficient'", kNotFinite, 4,
           "0.02 … 3"},
          {explore + "[friction_target]\nscael = 2\n", "'scael' in [friction_target]", kUnknownKey, 4},
          {explore + "[transient]\nmaterial = \"wodo\"\n", "'transient.material'", kUnknownWord, 4,
           "rubber, wood, metal"},
          {explore + "[transient]\n[[transient.mode]]\nfrequency_hz = 400\n",
           "'transient.mode[0].frequency_hz'", kOutOfRange, 5, "10 … 300 Hz"},
          {explore + "[transient]\nmaterial = \"wood\"\n[[transient.mode]]\nfrequency_hz = 50\n",
           "a material or modes", kContradiction, 5},
          {"kind = \"wall\"\n", "name", kMissingKey},
          {"name = \"../etc/passwd\"\n", "name", kMalformed, 1},
      },
      read_scene);
  test::expect_refusals({{"name = \"a\"\n", "name", kContradiction, 1}},
                        [](const std::string& toml) { return parse_scene(toml, "a file", "b"); });
}

TEST(SceneFile, WhatMeansNothingInAKindOfSceneIsRefused) {
  using enum hal::ErrorCode;
  const std::string tap = "name = \"x\"\n";
  const std::string wall = tap + "kind = \"wall\"\n";
  const std::string explore = tap + "kind = \"explore\"\n";
  test::expect_refusals(
      {
          {tap + "[tool]\ntip_to_centre_mm = [0, 0, 40]\n", "'tool.tip_to_centre_mm'", kMisplacedKey, 3},
          {tap + "[control]\nlead_ms = 5\n", "'control.lead_ms'", kMisplacedKey, 3},
          {tap + "[friction_target]\nscale = 2\n", "'friction_target'", kMisplacedKey, 2},
          {tap + "[target]\nlaw = \"hunt_crossley\"\n", "linear targets only", kMisplacedKey, 3},
          {wall + "[displacement]\nestimator = \"fused\"\n", "'displacement'", kMisplacedKey, 3},
          {wall + "[control]\nreaction_lead_share = 0.5\n", "'control.reaction_lead_share'", kMisplacedKey,
           4},
          {explore + "press_axis = [0, 0, -1]\n", "'press_axis'", kMisplacedKey, 3},
          {explore + "[wall]\nposition_mm = 1\n", "'wall'", kMisplacedKey, 3},
          {explore + "[target]\nlaw = \"position_profile\"\nstiffness_n_per_mm = 1\n",
           "'target.stiffness_n_per_mm'", kMisplacedKey, 5},
          {explore + "[target]\nprofile = [[0, 1]]\n", "'target.profile'", kMisplacedKey, 4},
      },
      read_scene);
}

TEST(SceneLibrary, KnowsTheBuiltInScenes) {
  const SceneLibrary library;
  const auto entries = library.list();
  const std::vector<std::string> names{"ball_watched",    "explore_bearing", "explore_rod", "explore_tumour",
                                       "explore_watched", "press_guided",    "tap_1d",      "wall",
                                       "wall_guided"};
  ASSERT_EQ(entries.size(), names.size());
  for (std::size_t i = 0; i < names.size(); ++i) EXPECT_EQ(entries[i].name, names[i]);
  for (const auto& entry : entries) {
    const auto scene = test::value_of(library.find(entry.name));
    EXPECT_EQ(scene.description, entry.description);
  }
  EXPECT_EQ(library.find("wall")->kind, rt::SceneKind::kWall);
  EXPECT_EQ(library.find("explore_rod")->tip, rt::Tip::kRod);
  EXPECT_EQ(library.find("explore_bearing")->tip, rt::Tip::kBallBearing);
  EXPECT_EQ(library.find("explore_tumour")->inclusions.size(), 1U);
  EXPECT_TRUE(library.find("press_guided")->fixture);
  EXPECT_TRUE(library.find("press_guided")->watch);
  EXPECT_TRUE(library.find("wall_guided")->fixture);
  for (const char* watched : {"wall_guided", "ball_watched", "explore_watched"}) {
    EXPECT_TRUE(library.find(watched)->watch) << watched;
  }
}

TEST(SceneFile, AllKeysThatAnInclusionsModelReplacesAreNamedAtOnce) {
  const hal::Error refused = test::error_of(parse_scene(
      "kind = \"explore\"\n[[inclusion]]\nstiffness_n_per_mm_m = 0.1\nplace_mm = [0.0, 0.0, -20.0]\n"
      "model = \"tumour\"\nattenuation = 6.0\n",
      "scene 'mine'", "mine"));
  EXPECT_EQ(refused.text(),
            "scene 'mine', line 3: the inclusion's model says this (got place_mm, stiffness_n_per_mm_m, "
            "attenuation); accepted: model = \"tumour\" alone; remove these keys, or the model");
  const auto one =
      parse_scene("kind = \"explore\"\n[[inclusion]]\nmodel = \"tumour\"\nexponent = 2.0\n", "scene", "mine");
  ASSERT_FALSE(one);
  EXPECT_EQ(one.error().remedy, "remove the key, or the model");
}

// As a rigid body: what is in the object keeps its depth, and its place to the axis that it is turned about.
TEST(SceneFile, AnInclusionOfARoundObjectTurnsAboutItsCentre) {
  auto scene = test::value_of(read_scene(
      "name = \"x\"\nkind = \"explore\"\n[[inclusion]]\nplace_mm = [5.0, 1.0, -20.0]\nsurface_mm = [2.0, "
      "3.0, 0.0]\n"
      "stiffness_n_per_mm_m = 0.1\nmoved_mm = [12.0, -5.0]\nobject_centre_mm = [0.0, 0.0, -63.0]\n"));
  const hal::Vector3 centre_mm{0.0, 0.0, -63.0};
  const hal::Vector3 surface_mm = scene.inclusions.at(0).surface_mm - centre_mm;
  const hal::Vector3 place_mm = scene.inclusions.at(0).place_mm - centre_mm;
  std::vector<std::string> stored;
  std::vector<std::string> remarks;
  ASSERT_FALSE(fill_inclusions(ModelLibrary(), {}, scene, stored, remarks));
  const hal::Vector3 turned_surface_mm = scene.inclusions.at(0).surface_mm - centre_mm;
  const hal::Vector3 turned_mm = scene.inclusions.at(0).place_mm - centre_mm;
  EXPECT_NEAR(turned_surface_mm.x, 14.0, 1e-9);
  EXPECT_NEAR(turned_surface_mm.y, -2.0, 1e-9);
  EXPECT_NEAR(rt::norm(turned_surface_mm), rt::norm(surface_mm), 1e-9);
  EXPECT_NEAR(rt::norm(turned_mm), rt::norm(place_mm), 1e-9);
  EXPECT_NEAR(dot(turned_mm, turned_surface_mm), dot(place_mm, surface_mm), 1e-9);
  const hal::Vector3 axis = rt::cross(surface_mm, turned_surface_mm);
  EXPECT_NEAR(dot(turned_mm, axis), dot(place_mm, axis), 1e-9);
  EXPECT_NEAR(dot(rt::cross(turned_surface_mm, turned_mm), axis), dot(rt::cross(surface_mm, place_mm), axis),
              1e-9);
}

TEST(SceneFile, AMapWithoutColumnsIsWrittenToo) {
  // A scene is written before it is checked, and what a client sends may be anything.
  const auto scene = test::value_of(parse_scene(
      "name = \"x\"\nkind = \"wall\"\n[wall.surface]\nstep_mm = 5.0\nheights_mm = [0.0, 1.0]\n", "x"));
  EXPECT_NE(write_scene(scene).find("heights_mm = [\n  0.0,\n  1.0,\n]\n"), std::string::npos);
}

TEST(SceneLibrary, AFolderAddsAndReplacesAndABrokenFileIsReported) {
  std::optional<test::TemporaryFolder> folder(std::in_place);
  folder->write("soft.toml", "description = \"mine\"\n[target]\nstiffness_n_per_mm = 0.1\n");
  folder->write("wall.toml", "kind = \"wall\"\ndescription = \"my own wall\"\n");
  folder->write("broken.toml", "oops = 1\n");
  folder->write("not a name.toml", "");
  const SceneLibrary library(folder->path());
  const auto entries = library.list();
  ASSERT_EQ(entries.size(), 11U);
  EXPECT_EQ(entries[1].name, "broken");
  EXPECT_NE(entries[1].description.find("unknown key 'oops'"), std::string::npos) << entries[1].description;
  EXPECT_EQ(entries[7].name, "soft");
  EXPECT_EQ(entries[9].description, "my own wall");
  EXPECT_EQ(library.find("soft")->target.stiffness_n_per_mm, 0.1);
  EXPECT_EQ(test::error_of(library.find("sof")).remedy, "did you mean 'soft'?");
  EXPECT_FALSE(library.find("../soft"));
  folder.reset();
  EXPECT_TRUE(library.check_folder());
}

}  // namespace
}  // namespace hapticd::server
