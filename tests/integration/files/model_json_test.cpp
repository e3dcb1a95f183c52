#include "server/model/model_json.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <functional>
#include <random>
#include <tuple>

#include "server/model/canonical_text.h"
#include "tests/support/model_examples.h"
#include "tests/support/refusals.h"
#include "tests/support/texts.h"
#include "tests/support/value_of.h"

namespace hapticd::server {
namespace {

using test::example_contact;

rt::ToolModel turned_tool() {
  rt::ToolModel tool = test::example_tool();
  tool.tip_to_centre_mm = {2.0, -3.0, 42.0};
  return tool;
}

rt::IdentifiedModel maxwell_slip_friction() {
  rt::IdentifiedModel model = test::example_friction("sponge_cut");
  rt::FrictionParameters& friction = std::get<rt::FrictionModel>(model.content).friction;
  friction.maxwell_slip = rt::MaxwellSlipParameters{{0.1, 0.3}, {1.0, 1.0 / 3.0}};
  friction.kinetic = friction.maxwell_slip->kinetic();
  return model;
}

std::vector<rt::IdentifiedModel> one_of_each() {
  return {test::example_contact("sponge_cut"),
          maxwell_slip_friction(),
          test::example_friction("sponge_cut"),
          test::example_friction("sponge_cut", rt::Tip::kBallBearing),
          test::example_of_rig(test::example_structure()),
          test::example_of_rig(test::example_tool()),
          test::example_of_rig(turned_tool()),
          test::example_of_rig(rt::ThresholdModel{0.012, 0.011, 20.0}),
          test::example_of_rig(rt::GainsModel{0.4, 0.02, 0.9, 14.0}),
          test::example_inclusion("lump")};
}

using test::replaced;

/// Exported model as someone who knows the trick would hand it in: the hash fits what it says.
std::string exported_with_hash_of(const std::string& canonical) {
  return export_json(canonical, sha256_hex(canonical));
}

TEST(ModelJson, HashesLikeEverybody) {
  EXPECT_EQ(sha256_hex(""), "e3b0c44298fc1c149afbf4c8996fb92427ae41e4649b934ca495991b7852b855");
  EXPECT_EQ(sha256_hex("abc"), "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad");
}

TEST(ModelJson, WithoutWhatCameLaterAModelHasTheTextItAlwaysHad) {
  for (const auto& [before, later, key] :
       {std::tuple(test::example_of_rig(test::example_tool()), test::example_of_rig(turned_tool()),
                   "tip_to_centre_mm"),
        {test::example_friction("sponge_cut"), maxwell_slip_friction(), "maxwell_slip"}}) {
    EXPECT_EQ(test::value_of(canonical_json(before)).find(key), std::string::npos)
        << "models stored before keep their hash";
    EXPECT_NE(test::value_of(canonical_json(later)).find(key), std::string::npos);
  }
}

TEST(ModelJson, TheTextIsCanonicalAndReadsBackAsTheSame) {
  for (const rt::IdentifiedModel& model : one_of_each()) {
    const auto text = test::value_of(canonical_json(model));
    const auto again = test::value_of(parse_canonical_json(text, "test"));
    EXPECT_EQ(*canonical_json(again), text);
    EXPECT_STREQ(rt::kind_name(again.content), rt::kind_name(model.content));
    EXPECT_EQ(again.procedure, model.procedure);
    EXPECT_EQ(again.parameters.size(), 2U);
    EXPECT_TRUE(std::isinf(again.parameters[1].standard_error));
    EXPECT_EQ(again.parameters[1].value, 1.0 / 3.0);
    EXPECT_EQ(text.find('\n'), std::string::npos);
    // Keys in order.
    std::vector<std::size_t> places;
    for (const char* key :
         {"\"content\":", "\"converged\":", "\"data_reference\":", "\"device\":", "\"kind\":"}) {
      places.push_back(text.find(key));
    }
    EXPECT_TRUE(std::is_sorted(places.begin(), places.end())) << text;
  }
}

// The hash names a model for good: it must not change with a library or a field's order.
TEST(ModelJson, AKnownModelHasItsKnownText) {
  rt::IdentifiedModel model = test::example_of_rig(rt::ThresholdModel{0.012, 0.0, 1e6});
  model.parameters = {{"threshold", "N", 0.1, 5e-324}};
  model.procedure = "free motion";
  model.residual = -0.0;
  const auto text = test::value_of(canonical_json(model));
  EXPECT_EQ(text,
            R"({"content":{"largest_residual_n":0,"observed_s":1e+06,"threshold_n":0.012},"converged":true,)"
            R"("data_reference":"session-0","device":"phantom_1_0","kind":"threshold","object":"",)"
            R"("parameters":[{"name":"threshold","standard_error":5e-324,"unit":"N","value":0.1}],)"
            R"("procedure":"free motion","residual":0,"schema":"hapticd.model/1","sensor":"nano17_si_25",)"
            R"("validity":{"max_displacement_mm":0,"max_force_n":0,"max_speed_mm_per_s":0}})");
  EXPECT_EQ(sha256_hex(text), sha256_hex(*canonical_json(*parse_canonical_json(text, "test"))));
}

TEST(ModelJson, EveryNumberSurvivesBitForBit) {
  std::mt19937_64 random(7);
  std::uniform_int_distribution<std::uint64_t> bits;
  for (int i = 0; i < 2000; ++i) {
    rt::IdentifiedModel model = example_contact("x");
    double value = 0.0;
    do {
      const std::uint64_t pattern = bits(random);
      std::memcpy(&value, &pattern, sizeof value);
    } while (!std::isfinite(value) || std::abs(value) > 1e299);
    model.parameters[0].value = value;
    const auto text = test::value_of(canonical_json(model));
    const auto again = parse_canonical_json(text, "test");
    ASSERT_TRUE(again) << value;
    ASSERT_EQ(again->parameters[0].value, value);
  }
}

TEST(ModelJson, WhatIsNoModelIsNotWritten) {
  const auto changed = [](rt::IdentifiedModel model,
                          const std::function<void(rt::IdentifiedModel&)>& change) {
    change(model);
    return model;
  };
  using Model = rt::IdentifiedModel;
  const Model contact = example_contact("x");
  const Model tool = test::example_of_rig(turned_tool());
  const Model slip = maxwell_slip_friction();
  for (const Model& wrong : {
           changed(contact,
                   [](Model& m) {
                     std::get<rt::ContactModel>(m.content).hunt_crossley->parameters.exponent = std::nan("");
                   }),
           changed(contact, [](Model& m) { m.residual = -1.0; }),
           changed(contact, [](Model& m) { m.object = "a b"; }),
           changed(contact, [](Model& m) { m.object = ""; }),
           changed(contact, [](Model& m) { m.procedure = "\xff\xfe"; }),
           changed(contact, [](Model& m) { m.procedure.assign(5000, 'a'); }),
           changed(tool, [](Model& m) { m.object = "x"; }),
           changed(tool,
                   [](Model& m) { std::get<rt::ToolModel>(m.content).tip_to_centre_mm->x = std::nan(""); }),
           changed(slip,
                   [](Model& m) { std::get<rt::FrictionModel>(m.content).tip = rt::Tip::kBallBearing; }),
           changed(slip, [](Model& m) { std::get<rt::FrictionModel>(m.content).friction.kinetic *= 2.0; }),
       }) {
    EXPECT_FALSE(canonical_json(wrong));
  }
}

TEST(ModelJson, AnExportIsImportedAsTheSame) {
  for (const rt::IdentifiedModel& model : one_of_each()) {
    const std::string canonical = *canonical_json(model);
    const auto imported = test::value_of(import_json(exported_with_hash_of(canonical)));
    EXPECT_EQ(imported.canonical, canonical);
    EXPECT_EQ(imported.hash, sha256_hex(canonical));
  }
  // Blanks and the order of keys do not matter.
  const std::string canonical = *canonical_json(example_contact("x"));
  std::string spaced = replaced(exported_with_hash_of(canonical), "{\"content\"", "{ \n \"content\"");
  EXPECT_TRUE(import_json(spaced));
}

TEST(ModelJson, AnEditedOrDamagedExportIsRefused) {
  using enum hal::ErrorCode;
  const std::string good = exported_with_hash_of(*canonical_json(example_contact("x")));
  std::string other_hash = good;
  char& digit = other_hash[other_hash.find("\"hash\": \"") + 9];
  digit = digit == '0' ? '1' : '0';
  const std::string unfit = "does not fit its hash";
  std::string of_many_values;
  std::string of_many_objects;
  for (int i = 0; i < 20000; ++i) {
    of_many_values += ",0";
    of_many_objects += ",{}";
  }
  test::expect_refusals(
      {
          {replaced(good, "\"exponent\":1.7", "\"exponent\":1.8"), unfit, kDamaged},
          {replaced(good, "\"converged\":true", "\"converged\":false"), unfit, kDamaged},
          {replaced(good, "\"model\": {", "\"model\": {\"more\":1,"), unfit, kDamaged},
          {other_hash, unfit, kDamaged},
          {good.substr(0, good.size() / 2), "JSON", kSyntax},
          {"", "JSON", kSyntax},
          {std::string(500000, '['), "JSON", kSyntax},
          {"[0" + of_many_values + "]", "too many values", kTooLong},
          {"[{}" + of_many_objects + "]", "too many values", kTooLong},
          {"[]", "exported model", kUnknownWord},
          {"{\"schema\": 3}", "exported model", kUnknownWord},
          {replaced(good, "hapticd.stored_model/1", "hapticd.stored_model/2"), "version", kUnknownWord},
          {replaced(good, "\"hash\"", "\"hush\""), "'hash'", kMissingKey},
          {std::string(2 << 20, ' '), "imported model", kTooLong},
      },
      import_json);
}

TEST(ModelJson, AFittingHashDoesNotMakeItAModel) {
  using enum hal::ErrorCode;
  const std::string good = *canonical_json(example_contact("x"));
  const auto with = [&good](const std::string& from, const std::string& to) {
    return exported_with_hash_of(replaced(good, from, to));
  };
  test::expect_refusals(
      {
          {with("hapticd.model/1", "hapticd.model/9"), "'hapticd.model/9'", kUnknownWord},
          {with("\"kind\":\"contact\"", "\"kind\":\"contakt\""), "'contakt'", kUnknownWord},
          {with("\"exponent\":1.7", "\"exponent\":7"), "hunt_crossley.exponent", kOutOfRange},
          {with("\"exponent\":1.7", "\"exponent\":\"Infinity\""), "hunt_crossley.exponent", kOutOfRange},
          {with("\"exponent\":1.7", "\"exponent\":\"1.7\""), "'content.hunt_crossley.law.exponent'",
           kWrongType},
          {with("\"exponent\":1.7", "\"exponent\":null"), "'content.hunt_crossley.law.exponent'", kWrongType},
          {with("\"residual\":0.04,", ""), "'residual'", kMissingKey},
          {with("\"residual\":0.04", "\"residual\":-1"), "residual", kOutOfRange},
          {with("\"converged\":true", "\"converged\":1"), "'converged'", kWrongType},
          {with("\"object\":\"x\"", "\"object\":\"x y\""), "object", kMalformed},
          {with("\"validity\":{", "\"validity\":{\"a\":1,"), "'validity.a'", kUnknownKey},
          {with("\"parameters\":[", "\"parameters\":[3,"), "'parameters[0]'", kWrongType},
      },
      import_json);
}

TEST(ModelJson, ARefusalHasFivePartsAndACode) {
  using enum hal::ErrorCode;
  const auto imported = import_json("{\"schema\": \"hapticd.stored_model/2\"}");
  ASSERT_FALSE(imported);
  test::expect_same(
      imported.error(),
      {"not an exported model, or of another version", "imported model", "schema \"hapticd.stored_model/2\"",
       "schema \"hapticd.stored_model/1\"", "export the model again where it came from", kUnknownWord});
}

}  // namespace
}  // namespace hapticd::server
