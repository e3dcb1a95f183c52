#include "client/cli/view/stored_model_view.h"

#include <gtest/gtest.h>

#include <limits>

#include "tests/support/texts.h"

namespace hapticd::cli {
namespace {

v1::StoredModel some_model() {
  v1::StoredModel model;
  model.set_hash("1a2b3c4d5e6f70819293a4b5c6d7e8f91a2b3c4d5e6f70819293a4b5c6d7e8f9");
  model.set_kind("contact");
  model.set_object("sponge");
  model.set_device("phantom_1_0");
  model.set_procedure("palpation");
  model.set_max_displacement_mm(6.1);
  model.set_max_force_n(5.81234);
  model.set_residual(0.042);
  model.set_in_use(true);
  model.add_tags("current");
  model.add_tags("soft");
  auto& exponent = *model.add_parameters();
  exponent.set_name("exponent");
  exponent.set_unit("1");
  exponent.set_value(1.71823);
  exponent.set_standard_error(0.0021);
  auto& open = *model.add_parameters();
  open.set_name("damping");
  open.set_unit("N·s/mm");
  open.set_value(0.1);
  open.set_standard_error(std::numeric_limits<double>::infinity());
  return model;
}

void expect_holds(const std::string& text, const std::vector<std::string>& parts) {
  for (const std::string& part : parts)
    EXPECT_NE(text.find(part), std::string::npos) << part << " in\n" << text;
}

TEST(StoredModelView, AWordIsTakenForAHashOnlyIfItCanBeOne) {
  EXPECT_TRUE(looks_like_hash("1a2b3c"));
  EXPECT_TRUE(looks_like_hash("ABCDEF0123"));
  for (const char* word : {"", "1a2b3", "foam_ball_3d", "1a2b3g", "sponge@1a2b3c"}) {
    EXPECT_FALSE(looks_like_hash(word)) << word;
  }
}

TEST(StoredModelView, ListsOneALine) {
  v1::ListStoredModelsResponse models;
  EXPECT_EQ(stored_model_list(models, Terminal{}), std::vector<std::string>{"no model is stored"});
  *models.add_models() = some_model();
  v1::StoredModel& tool = *models.add_models();
  tool.set_hash(std::string(64, 'f'));
  tool.set_kind("tool");
  tool.set_converged(true);
  const auto lines = stored_model_list(models, Terminal{});
  ASSERT_EQ(lines.size(), 3U);
  expect_holds(lines[1], {"*", "1a2b3c4d5e6f ", "contact", "sponge", "current, soft", "4.2 %", "no",
                          "phantom_1_0 / ?"});
  expect_holds(lines[2], {"ffffffffffff", "tool", " - ", "yes"});
  EXPECT_EQ(lines[2].find('*'), std::string::npos);
}

TEST(StoredModelView, ShowsAllThatIsKnown) {
  const std::string text = test::joined(stored_model_text(some_model(), Terminal{}));
  expect_holds(text, {some_model().hash(), "down to 6.1 mm, up to 5.81234 N\n", "4.2 % of rms",
                      "by the loaded scene", "current, soft", "1.71823", "0.0021", "inf", "N·s/mm"});
}

TEST(StoredModelView, ComparesParameterByParameter) {
  v1::DiffStoredModelsResponse difference;
  *difference.mutable_a() = some_model();
  *difference.mutable_b() = some_model();
  difference.mutable_b()->set_hash(std::string(64, 'b'));
  auto& both = *difference.add_parameters();
  both.set_name("exponent");
  both.set_unit("1");
  both.set_value_a(1.5);
  both.set_value_b(1.8);
  both.set_relative(0.2);
  both.set_deviations(4.25);
  auto& one = *difference.add_parameters();
  one.set_name("only_here");
  one.set_unit("s");
  one.set_value_b(3.0);
  difference.add_remarks("device: 'x' against 'y'");
  const auto lines = model_difference_text(difference, Terminal{});
  ASSERT_EQ(lines.size(), 4U);
  expect_holds(lines[0], {"1a2b3c4d5e6f", "bbbbbbbbbbbb"});
  expect_holds(lines[1], {"exponent", "1.5", "1.8", "+20.00 %", "4.2"});
  expect_holds(lines[2], {"only_here", "-", "3", "s"});
  EXPECT_EQ(lines[3], "device: 'x' against 'y'");
}

}  // namespace
}  // namespace hapticd::cli
