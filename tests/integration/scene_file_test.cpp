#include "server/scene_file.h"

#include <gtest/gtest.h>

#include <optional>
#include <random>

#include "server/scene_library.h"
#include "tests/support/temporary_folder.h"

namespace hapticd::server {
namespace {

/// Every number of a scene, by reference. The bindings name all members, so a new one fails to compile here
/// until the scene file can say it.
std::vector<double*> numbers_of(rt::SceneSpec& spec) {
  auto& [name, kind, description, tip, object_model, axis, mass, contact, wall, target, max_target, ramp,
         compensation, structural, control, guard] = spec;
  auto& [method, threshold, ratio, release_ticks, clearance, quiet_ticks, free_ticks] = contact;
  auto& [law, proportional, derivative] = control;
  auto& [force, rate, power, stale, resume] = guard;
  static_cast<void>(name), static_cast<void>(kind), static_cast<void>(description), static_cast<void>(tip);
  static_cast<void>(object_model), static_cast<void>(compensation), static_cast<void>(method);
  static_cast<void>(release_ticks), static_cast<void>(quiet_ticks), static_cast<void>(free_ticks);
  static_cast<void>(law);
  return {&axis.x, &axis.y, &axis.z,     &mass,  &threshold,  &ratio,        &clearance,
          &wall,   &target, &max_target, &ramp,  &structural, &proportional, &derivative,
          &force,  &rate,   &power,      &stale, &resume};
}

void expect_error(const std::string& toml, const hal::Error& expected) {
  const auto scene = parse_scene(toml, "scene text");
  ASSERT_FALSE(scene) << toml;
  EXPECT_EQ(scene.error().what, expected.what);
  EXPECT_EQ(scene.error().where, expected.where);
  EXPECT_EQ(scene.error().value, expected.value);
  EXPECT_EQ(scene.error().limit, expected.limit);
  EXPECT_EQ(scene.error().remedy, expected.remedy);
}

TEST(SceneFile, WhatIsWrittenReadsBackBitForBit) {
  std::mt19937_64 random(1);
  std::uniform_real_distribution<double> fraction(0.01, 0.99);  // inside every range
  for (int round = 0; round < 100; ++round) {
    rt::SceneSpec spec;
    spec.name = "round-trip_1";
    spec.kind = round % 2 == 0 ? rt::SceneKind::kTap1d : rt::SceneKind::kWall;
    spec.description = "quotes \" and \\ and\nlines and ε and \x01";
    spec.tip = "ball bearing";
    spec.object_model = "sponge";
    spec.structural_compensation = round % 3 == 0;
    spec.contact.method =
        round % 2 == 0 ? rt::ContactMethod::kMatchedInertia : rt::ContactMethod::kFilteredAcceleration;
    spec.contact.release_ticks = static_cast<std::uint32_t>(1 + round);
    spec.contact.quiet_ticks_after_release = static_cast<std::uint32_t>(1 + 3 * round);
    spec.contact.free_ticks_to_arm = static_cast<std::uint32_t>(1 + 7 * round);
    spec.controller.law = round % 2 == 0 ? rt::ControlLaw::kClosedLoop : rt::ControlLaw::kOpenLoop;
    for (double* number : numbers_of(spec)) *number = fraction(random);

    const std::string text = write_scene(spec);
    auto again = parse_scene(text, "written");
    ASSERT_TRUE(again) << again.error().text() << "\n" << text;
    const auto before = numbers_of(spec);
    const auto after = numbers_of(*again);
    for (std::size_t i = 0; i < before.size(); ++i) EXPECT_EQ(*before[i], *after[i]) << "number " << i;
    EXPECT_EQ(again->name, spec.name);
    EXPECT_EQ(again->kind, spec.kind);
    EXPECT_EQ(again->description, spec.description);
    EXPECT_EQ(again->tip, spec.tip);
    EXPECT_EQ(again->object_model, spec.object_model);
    EXPECT_EQ(again->structural_compensation, spec.structural_compensation);
    EXPECT_EQ(again->contact.method, spec.contact.method);
    EXPECT_EQ(again->contact.release_ticks, spec.contact.release_ticks);
    EXPECT_EQ(again->contact.quiet_ticks_after_release, spec.contact.quiet_ticks_after_release);
    EXPECT_EQ(again->contact.free_ticks_to_arm, spec.contact.free_ticks_to_arm);
    EXPECT_EQ(again->controller.law, spec.controller.law);
    EXPECT_EQ(write_scene(*again), text);
  }
}

TEST(SceneFile, UnknownKeysAreRefusedByNameLineAndSuggestion) {
  expect_error("name = \"x\"\n[target]\nstifness = 0.5\n",
               {"unknown key 'stifness' in [target]", "scene text, line 3", "",
                "stiffness_n_per_mm, max_stiffness_n_per_mm, ramp_s", "did you mean 'stiffness_n_per_mm'?"});
  expect_error(
      "name = \"x\"\n[contcat]\nthreshold_n = 0.5\n",
      {"unknown key 'contcat'", "scene text, line 2", "",
       "name, kind, description, object_model, press_axis, tool, contact, wall, target, structure, control, "
       "guard",
       "did you mean 'contact'?"});
}

TEST(SceneFile, ValuesHaveRangesAndUnits) {
  expect_error("name = \"x\"\n[target]\nstiffness_n_per_mm = -0.5\n",
               {"'target.stiffness_n_per_mm' is out of range", "scene text, line 3", "-0.5 N/mm",
                "0 … 1000 N/mm", "use at least 0 N/mm"});
  expect_error("name = \"x\"\npress_axis = [0, 0]\n",
               {"'press_axis' has the wrong type", "scene text, line 2", "an array",
                "three numbers, each -1 … 1", "correct the value"});
  expect_error("name = \"x\"\n[contact]\nthreshold_n = inf\n",
               {"'contact.threshold_n' is not finite", "scene text, line 3", "inf", "0.0001 … 5 N",
                "send a finite number"});
}

TEST(SceneFile, ASceneHasAName) {
  expect_error("kind = \"wall\"\n",
               {"the scene has no name", "scene text", "", "", "add name = \"…\" at its top"});
  expect_error("name = \"../etc/passwd\"\n", {"not a name for a scene", "scene text, line 1", "../etc/passwd",
                                              "1 … 64 of a-z A-Z 0-9 _ -", "choose such a name"});
  const auto renamed = parse_scene("name = \"a\"\n", "a file", "b");
  ASSERT_FALSE(renamed);
  EXPECT_EQ(renamed.error().what, "the scene's name is not that of its file");
}

TEST(SceneFile, NoTextCrashesTheReader) {
  const std::string seed = "name = \"x\"\n[target]\nstiffness_n_per_mm = 0.5\npress_axis = [0, 0, -1]\n";
  std::mt19937 random(7);
  for (int round = 0; round < 5000; ++round) {
    std::string text = seed;
    for (int change = 0; change < 4; ++change)
      text[random() % text.size()] = static_cast<char>(random() % 256);
    const auto scene = parse_scene(text.substr(0, random() % (text.size() + 1)), "scene text");
    if (!scene) {
      EXPECT_FALSE(scene.error().what.empty());
    }
  }
  EXPECT_FALSE(parse_scene("x = " + std::string(100000, '['), "scene text"));
}

TEST(SceneLibrary, KnowsTheBuiltInScenes) {
  const SceneLibrary library;
  const auto entries = library.list();
  ASSERT_EQ(entries.size(), 2U);
  EXPECT_EQ(entries[0].name, "tap_1d");
  EXPECT_EQ(entries[1].name, "wall");
  for (const auto& entry : entries) {
    const auto scene = library.find(entry.name);
    ASSERT_TRUE(scene) << scene.error().text();
    EXPECT_EQ(scene->description, entry.description);
  }
  EXPECT_EQ(library.find("wall")->kind, rt::SceneKind::kWall);
}

TEST(SceneLibrary, AFolderAddsAndReplacesAndABrokenFileIsTold) {
  std::optional<test::TemporaryFolder> folder(std::in_place);
  folder->write("soft.toml", "description = \"mine\"\n[target]\nstiffness_n_per_mm = 0.1\n");
  folder->write("wall.toml", "kind = \"wall\"\ndescription = \"my own wall\"\n");
  folder->write("broken.toml", "oops = 1\n");
  folder->write("not a name.toml", "");
  const SceneLibrary library(folder->path());
  const auto entries = library.list();
  ASSERT_EQ(entries.size(), 4U);
  EXPECT_EQ(entries[0].name, "broken");
  EXPECT_NE(entries[0].description.find("unknown key 'oops'"), std::string::npos) << entries[0].description;
  EXPECT_EQ(entries[1].name, "soft");
  EXPECT_EQ(entries[3].description, "my own wall");
  EXPECT_EQ(library.find("soft")->target_stiffness_n_per_mm, 0.1);
  const auto unknown = library.find("sof");
  ASSERT_FALSE(unknown);
  EXPECT_EQ(unknown.error().remedy, "did you mean 'soft'?");
  EXPECT_FALSE(library.find("../soft"));
  folder.reset();
  EXPECT_TRUE(library.check_folder());
}

}  // namespace
}  // namespace hapticd::server
