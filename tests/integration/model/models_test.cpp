#include <gtest/gtest.h>

#include <algorithm>

#include "tests/integration/error_detail.h"
#include "tests/integration/running_service.h"
#include "tests/support/temporary_folder.h"

namespace hapticd::test {
namespace {

constexpr const char* kFriction =
    "[rod_friction]\nkinetic = 0.5\npresliding_mm = 1\nviscous_n_s_per_mm = 0\n";

v1::ListModelsResponse list(const RunningService& service) {
  return answer_of(*service.model, &v1::ModelService::Stub::ListModels);
}

grpc::Status show(const RunningService& service, const std::string& name, v1::GetModelResponse& response) {
  v1::GetModelRequest request;
  request.set_name(name);
  return service.model->GetModel(call_context().get(), request, &response);
}

TEST(ServiceModels, AreListedWithTheirPartsAndShownWhole) {
  const RunningService service;
  const auto models = list(service);
  const auto foam = std::find_if(models.models().begin(), models.models().end(),
                                 [](const auto& model) { return model.name() == "foam_ball_3d"; });
  ASSERT_NE(foam, models.models().end());
  EXPECT_TRUE(foam->creep());
  EXPECT_TRUE(foam->rod_friction());
  EXPECT_GT(foam->creep_relative_error(), 0.0);
  EXPECT_GT(foam->max_force_n(), 0.0);
  EXPECT_GT(foam->max_displacement_mm(), 0.0);
  EXPECT_EQ(foam->problem(), "");

  v1::GetModelResponse shown;
  ASSERT_TRUE(show(service, "foam_ball_3d", shown).ok());
  EXPECT_EQ(shown.summary().SerializeAsString(), foam->SerializeAsString());
  EXPECT_TRUE(shown.toml().starts_with("name = \"foam_ball_3d\"\n")) << shown.toml();
  EXPECT_NE(shown.toml().find("\n[creep]\n"), std::string::npos);
}

TEST(ServiceModels, AnUnknownNameAndABrokenFileOfTheFolderAreRefused) {
  const TemporaryFolder folder;
  const std::string broken = folder.write("broken.toml", "[creep]\nmax_force = 3\n");
  server::DaemonConfig config = quiet_config();
  config.model_folder = folder.path();
  const RunningService service(config);
  const auto models = list(service);
  const auto listed = std::find_if(models.models().begin(), models.models().end(),
                                   [](const auto& model) { return model.name() == "broken"; });
  ASSERT_NE(listed, models.models().end());
  EXPECT_TRUE(listed->problem().starts_with(broken + ", line 2: ")) << listed->problem();
  v1::GetModelResponse shown;
  expect_refused(show(service, "broken", shown), grpc::StatusCode::INVALID_ARGUMENT, broken + ", line 2");
  expect_refused(service.load_toml("name = \"mine\"\nkind = \"explore\"\nobject_model = \"broken\"\n"),
                 grpc::StatusCode::FAILED_PRECONDITION, broken + ", line 2");
  expect_refused_for(show(service, "foam_bal_3d", shown), grpc::StatusCode::NOT_FOUND,
                     v1::ERROR_REASON_NOT_FOUND);
  expect_refused(show(service, "../x", shown), grpc::StatusCode::INVALID_ARGUMENT, v1::ERROR_REASON_INVALID,
                 "GetModelRequest.name");
}

TEST(ServiceModels, AFileMayBeEditedWhileTheDaemonRuns) {
  const TemporaryFolder folder;
  server::DaemonConfig config = quiet_config();
  config.model_folder = folder.path();
  const RunningService service(config);
  const std::string scene =
      "name = \"mine\"\nkind = \"explore\"\nobject_model = \"late\"\n"
      "[displacement]\nestimator = \"recursive\"\n";
  EXPECT_EQ(service.load_toml(scene).error_code(), grpc::StatusCode::FAILED_PRECONDITION);
  folder.write("late.toml", kFriction);
  EXPECT_TRUE(ok(service.load_toml(scene)));
}

}  // namespace
}  // namespace hapticd::test
