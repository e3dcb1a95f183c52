#include "server/model/model_file.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <optional>
#include <random>
#include <tuple>

#include "server/model/store/model_library.h"
#include "tests/support/refusals.h"
#include "tests/support/temporary_folder.h"
#include "tests/support/value_of.h"

namespace hapticd::server {
namespace {

rt::ObjectModel some_model(std::mt19937_64& random) {
  std::uniform_real_distribution<double> fraction(0.01, 0.99);
  rt::ObjectModel model;
  model.name = "a_foam-2";
  model.identified_on = "sim:phantom_1_0, \"palpation\" at 2 N\nand ε";
  model.max_displacement_mm = 10.0 * fraction(random);
  model.max_force_n = 5.0 * fraction(random);
  auto& power = model.hunt_crossley.emplace();
  power.parameters = {fraction(random), fraction(random), 1.0 + fraction(random)};
  power.relative_error = fraction(random);
  auto& creep = model.creep.emplace();
  for (double& time_s : creep.parameters.time_s) time_s = fraction(random);
  for (double& weight : creep.parameters.weight) weight = fraction(random);
  creep.parameters.max_force_n = fraction(random);
  for (std::size_t i = 1; i < creep.parameters.displacement_mm.size(); ++i) {
    creep.parameters.displacement_mm[i] = creep.parameters.displacement_mm[i - 1] + fraction(random);
  }
  creep.relative_error = fraction(random);
  for (auto* friction : {&model.rod_friction, &model.bearing_friction}) {
    *friction = rt::FrictionParameters{
        fraction(random), fraction(random), fraction(random), fraction(random), {}, fraction(random)};
  }
  rt::MaxwellSlipParameters& elements = model.rod_friction->maxwell_slip.emplace();
  for (std::size_t i = 0; i + 1 < elements.reach_mm.size(); ++i) {
    elements.reach_mm[i] = fraction(random);
    elements.stiffness_per_mm[i] = fraction(random) / 8.0;
  }
  model.rod_friction->kinetic = elements.kinetic();
  return model;
}

/// All that a file says of a model, part by part.
auto contents_of(const rt::ObjectModel& model) {
  const auto law = [](const auto& part) {
    const auto& [stiffness, damping, exponent] = part.parameters;
    return std::tuple(stiffness, damping, exponent, part.relative_error);
  };
  const auto creep = [](const auto& part) {
    const auto& [times, weights, displacements, max_force] = part.parameters;
    return std::tuple(times, weights, displacements, max_force, part.relative_error);
  };
  const auto friction = [](const rt::FrictionParameters& part) {
    const auto elements = part.maxwell_slip.value_or(rt::MaxwellSlipParameters{});
    return std::tuple(part.kinetic, part.presliding_mm, part.viscous_n_s_per_mm, part.exponent,
                      part.presliding_relative_error, part.maxwell_slip.has_value(), elements.reach_mm,
                      elements.stiffness_per_mm);
  };
  const auto of = [](const auto& part, const auto& fields) {
    return part ? std::optional(fields(*part)) : std::nullopt;
  };
  return std::tuple(model.name, model.identified_on, model.max_displacement_mm, model.max_force_n,
                    of(model.hunt_crossley, law), of(model.creep, creep), of(model.rod_friction, friction),
                    of(model.bearing_friction, friction));
}

hal::Result<rt::ObjectModel> read_model(const std::string& toml) {
  return parse_model(toml, "model text");
}

TEST(ModelFile, WhatIsWrittenReadsBackBitForBit) {
  std::mt19937_64 random(3);
  for (int parts = 0; parts < 64; ++parts) {
    rt::ObjectModel model = some_model(random);
    if ((parts & 1) != 0) model.hunt_crossley.reset();
    if ((parts & 2) != 0) model.creep.reset();
    if ((parts & 4) != 0) model.rod_friction.reset();
    if ((parts & 8) != 0) model.bearing_friction.reset();
    if ((parts & 16) != 0 && model.rod_friction) model.rod_friction->maxwell_slip.reset();
    const std::string text = write_model(model);
    const auto again = test::value_of(parse_model(text, "written"));
    EXPECT_EQ(contents_of(again), contents_of(model));
    EXPECT_EQ(write_model(again), text);
  }
}

TEST(ModelFile, ARefusalHasFivePartsAndACode) {
  using enum hal::ErrorCode;
  const auto model = read_model("name = \"x\"\n[rod_friction]\nkinetik = 1\n");
  ASSERT_FALSE(model);
  test::expect_same(model.error(), {"unknown key 'kinetik' in [rod_friction]", "model text, line 3", "",
                                    "kinetic, presliding_mm, viscous_n_s_per_mm, exponent, "
                                    "presliding_relative_error, maxwell_slip",
                                    "did you mean 'kinetic'?", kUnknownKey});
}

TEST(ModelFile, WhatIsWrongIsRefusedByKeyAndLine) {
  using enum hal::ErrorCode;
  std::mt19937_64 random(5);
  rt::ObjectModel flat = some_model(random);
  flat.creep->parameters.displacement_mm[4] = flat.creep->parameters.displacement_mm[3];
  test::expect_refusals(
      {
          {"name = \"x\"\n[hunt_crossly]\nexponent = 1\n", "'hunt_crossly'", kUnknownKey, 2},
          {"name = \"x\"\n[rod_friction]\nkinetic = 1\n", "'rod_friction.presliding_mm'", kMissingKey},
          {"name = \"x\"\ncreep = 3\n", "'creep'", kWrongType, 2},
          {"name = \"x\"\nmax_force_n = -1\n", "'max_force_n'", kOutOfRange, 2, "0 … 1000 N"},
          {"name = \"x\"\n[creep]\ntime_s = [1, 2]\n", "'creep.time_s'", kWrongType, 3,
           "4 numbers, each 0.0001 … 1000 s"},
          {write_model(flat), "creep.displacement_mm", kOutOfRange},
          {"max_force_n = 1\n", "name", kMissingKey},
          {"name = \"a b\"\n", "name", kMalformed, 1},
      },
      read_model);
  test::expect_refusals({{"name = \"a\"\n", "name", kContradiction, 1}},
                        [](const std::string& toml) { return parse_model(toml, "a file", "b"); });
}

TEST(ModelFile, MaxwellSlipElementsAreEightEachAndFitTheLevel) {
  using enum hal::ErrorCode;
  const std::string rod =
      "name = \"x\"\n[rod_friction]\nkinetic = 0.5\npresliding_mm = 0.2\nviscous_n_s_per_mm = 0\n";
  const std::string reaches = "reach_mm = [0.1, 0.4, 0, 0, 0, 0, 0, 0]";
  const auto elements = [&](const std::string& inside) {
    return rod + "maxwell_slip = { " + inside + " }\n";
  };
  const auto good = test::value_of(
      parse_model(elements(reaches + ", stiffness_per_mm = [1, 1, 0, 0, 0, 0, 0, 0]"), "model text"));
  EXPECT_EQ(good.rod_friction->maxwell_slip->reach_mm[1], 0.4);
  test::expect_refusals(
      {
          {elements(reaches), "'rod_friction.maxwell_slip.stiffness_per_mm'", kMissingKey},
          {elements("reach_mm = [0.1]"), "'rod_friction.maxwell_slip.reach_mm'", kWrongType, 6,
           "8 numbers, each 0 … 1000 mm"},
          {elements(reaches + ", stiffness_per_mm = [1, 2, 0, 0, 0, 0, 0, 0]"), "rod_friction.kinetic",
           kContradiction},
      },
      read_model);
}

TEST(ModelLibrary, TheBuiltInModelsAreSound) {
  const ModelLibrary library;
  const auto entries = library.list();
  EXPECT_FALSE(entries.empty());
  for (const auto& entry : entries) {
    ASSERT_TRUE(entry.model) << entry.name << ": " << entry.problem;
    EXPECT_EQ(entry.model->name, entry.name);
    EXPECT_EQ(entry.problem, "");
  }
  for (const char* name : {"foam_ball_3d", "rubber_ball_3d", "silicone_rest", "sponge_cut"}) {
    EXPECT_TRUE(library.contains(name)) << name;
  }
}

TEST(ModelLibrary, AFolderAddsAndReplacesAndABrokenFileIsReported) {
  using enum hal::ErrorCode;
  const test::TemporaryFolder folder;
  folder.write("broken.toml", "oops = 1\n");
  folder.write("mine.toml", "[rod_friction]\nkinetic = 0.5\npresliding_mm = 1\nviscous_n_s_per_mm = 0\n");
  folder.write("sponge_cut.toml", "identified_on = \"my own\"\n");
  const ModelLibrary library(folder.path());
  const auto entries = library.list();
  const auto broken =
      std::find_if(entries.begin(), entries.end(), [](const auto& entry) { return entry.name == "broken"; });
  ASSERT_NE(broken, entries.end());
  EXPECT_FALSE(broken->model);
  EXPECT_NE(broken->problem.find("broken.toml, line 1: unknown key 'oops'"), std::string::npos)
      << broken->problem;
  ASSERT_TRUE(library.find("mine"));
  EXPECT_FALSE(library.find("mine")->creep);
  EXPECT_EQ(library.find("sponge_cut")->identified_on, "my own");
  const hal::Error unknown = test::error_of(library.find("mein"));
  EXPECT_EQ(unknown.code, kNotFound);
  EXPECT_EQ(unknown.remedy, "did you mean 'mine'?");
  EXPECT_FALSE(library.find("../mine"));
  EXPECT_FALSE(library.check_folder());
  EXPECT_TRUE(ModelLibrary(folder.path("none")).check_folder());
}

}  // namespace
}  // namespace hapticd::server
