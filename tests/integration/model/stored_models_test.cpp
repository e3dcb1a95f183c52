#include <SQLiteCpp/SQLiteCpp.h>
#include <gtest/gtest.h>

#include <cmath>
#include <optional>

#include "server/model/canonical_text.h"
#include "server/model/model_json.h"
#include "tests/integration/daemon_process.h"
#include "tests/integration/error_detail.h"
#include "tests/integration/running_service.h"
#include "tests/support/model_examples.h"
#include "tests/support/temporary_folder.h"
#include "tests/support/texts.h"

namespace hapticd::test {
namespace {

using grpc::StatusCode;

std::string exported(const rt::IdentifiedModel& model) {
  const auto canonical = server::canonical_json(model);
  EXPECT_TRUE(canonical) << canonical.error().text();
  return server::export_json(*canonical, server::sha256_hex(*canonical));
}

v1::StoredModel import(v1::ModelService::Stub& stub, const rt::IdentifiedModel& model) {
  v1::ImportStoredModelRequest request;
  request.set_json(exported(model));
  v1::StoredModel stored;
  EXPECT_TRUE(ok(stub.ImportStoredModel(call_context().get(), request, &stored)));
  return stored;
}

grpc::Status tag(v1::ModelService::Stub& stub, const std::string& hash, const std::string& name,
                 v1::StoredModel* stored = nullptr) {
  v1::TagStoredModelRequest request;
  request.set_hash(hash);
  request.set_tag(name);
  v1::StoredModel unused;
  return stub.TagStoredModel(call_context().get(), request, stored != nullptr ? stored : &unused);
}

v1::ListStoredModelsResponse list(v1::ModelService::Stub& stub, const std::string& kind = {}) {
  v1::ListStoredModelsRequest request;
  request.set_kind(kind);
  v1::ListStoredModelsResponse models;
  EXPECT_TRUE(stub.ListStoredModels(call_context().get(), request, &models).ok());
  return models;
}

grpc::Status erase(v1::ModelService::Stub& stub, const std::string& hash) {
  v1::DeleteStoredModelRequest request;
  request.set_hash(hash);
  v1::DeleteStoredModelResponse response;
  const grpc::Status status = stub.DeleteStoredModel(call_context().get(), request, &response);
  if (status.ok()) {
    EXPECT_TRUE(response.hash().starts_with(hash));
  }
  return status;
}

TEST(ServiceStoredModels, AreImportedListedShownExportedAndDeleted) {
  const RunningService service;
  v1::ModelService::Stub& stub = *service.model;
  EXPECT_TRUE(list(stub).models().empty());
  const v1::StoredModel sponge = import(stub, example_contact("sponge"));
  const v1::StoredModel tool = import(stub, example_of_rig(example_tool()));
  EXPECT_EQ(sponge.hash(), server::sha256_hex(*server::canonical_json(example_contact("sponge"))));
  EXPECT_EQ(sponge.kind(), "contact");
  EXPECT_EQ(sponge.object(), "sponge");
  EXPECT_EQ(sponge.device(), "phantom_1_0");
  EXPECT_EQ(sponge.data_reference(), "session-0");
  EXPECT_EQ(sponge.max_force_n(), 5.8);
  EXPECT_TRUE(sponge.converged());
  EXPECT_FALSE(sponge.in_use());
  EXPECT_GT(sponge.stored_at_unix_s(), 1'600'000'000);
  ASSERT_EQ(sponge.parameters_size(), 2);
  EXPECT_EQ(sponge.parameters(0).standard_error(), 0.01);
  EXPECT_TRUE(std::isinf(sponge.parameters(1).standard_error()));

  const auto models = list(stub);
  ASSERT_EQ(models.models_size(), 2);
  EXPECT_EQ(models.models(0).hash(), tool.hash()) << "the newest first";
  EXPECT_EQ(list(stub, "contact").models_size(), 1);

  v1::GetStoredModelRequest get;
  get.set_hash(sponge.hash().substr(0, 8));
  v1::StoredModel shown;
  ASSERT_TRUE(stub.GetStoredModel(call_context().get(), get, &shown).ok());
  EXPECT_EQ(shown.SerializeAsString(), sponge.SerializeAsString());

  v1::ExportStoredModelRequest export_request;
  export_request.set_hash(sponge.hash());
  v1::ExportStoredModelResponse json;
  ASSERT_TRUE(stub.ExportStoredModel(call_context().get(), export_request, &json).ok());
  EXPECT_EQ(json.json(), exported(example_contact("sponge")));

  EXPECT_TRUE(erase(stub, sponge.hash().substr(0, 8)).ok());
  expect_refused(stub.GetStoredModel(call_context().get(), get, &shown), StatusCode::NOT_FOUND,
                 v1::ERROR_REASON_NOT_FOUND, "hash");
}

TEST(ServiceStoredModels, WhatIsNoneIsRefused) {
  const RunningService service;
  v1::ModelService::Stub& stub = *service.model;
  v1::GetStoredModelRequest get;
  get.set_hash("'; DROP");
  v1::StoredModel stored;
  expect_refused(stub.GetStoredModel(call_context().get(), get, &stored), StatusCode::INVALID_ARGUMENT,
                 v1::ERROR_REASON_INVALID, "hash");
  v1::ImportStoredModelRequest request;
  request.set_json("{}");
  EXPECT_EQ(stub.ImportStoredModel(call_context().get(), request, &stored).error_code(),
            StatusCode::INVALID_ARGUMENT);
  std::string edited = exported(example_contact("sponge"));
  edited.replace(edited.find("\"converged\":true"), 16, "\"converged\":false");
  request.set_json(edited);
  expect_refused_saying(stub.ImportStoredModel(call_context().get(), request, &stored),
                        StatusCode::INVALID_ARGUMENT,
                        "the content does not fit its hash: it was altered or damaged on the way");
  EXPECT_TRUE(list(stub).models().empty());
}

TEST(ServiceStoredModels, AreComparedParameterByParameter) {
  const RunningService service;
  v1::ModelService::Stub& stub = *service.model;
  v1::DiffStoredModelsRequest request;
  request.set_hash_a(import(stub, example_contact("sponge", 0)).hash());
  request.set_hash_b(import(stub, example_contact("sponge", 100)).hash());
  v1::DiffStoredModelsResponse difference;
  ASSERT_TRUE(stub.DiffStoredModels(call_context().get(), request, &difference).ok());
  EXPECT_EQ(difference.a().hash(), request.hash_a());
  ASSERT_EQ(difference.parameters_size(), 2);
  EXPECT_NEAR(difference.parameters(0).relative(), 0.1 / 1.5, 1e-12);
  EXPECT_FALSE(difference.parameters(1).has_deviations());
  EXPECT_EQ(difference.remarks_size(), 1);
  request.set_hash_b(import(stub, example_friction("sponge")).hash());
  EXPECT_EQ(stub.DiffStoredModels(call_context().get(), request, &difference).error_code(),
            StatusCode::INVALID_ARGUMENT);
}

TEST(ServiceStoredModels, TheCurrentOneIsWhatScenesGetAndIsNotDeletedWhileInUse) {
  const RunningService service;
  v1::ModelService::Stub& stub = *service.model;
  const std::string contact = import(stub, example_contact("gel")).hash();
  const std::string friction = import(stub, example_friction("gel")).hash();
  v1::LoadSceneRequest load;
  load.set_name("explore_rod");
  load.set_object_model("gel");
  v1::LoadSceneResponse loaded;
  const grpc::Status untagged = service.scene->LoadScene(call_context().get(), load, &loaded);
  EXPECT_EQ(untagged.error_code(), StatusCode::FAILED_PRECONDITION) << "stored, but no one's choice yet";

  v1::StoredModel tagged;
  ASSERT_TRUE(tag(stub, contact.substr(0, 10), "current", &tagged).ok());
  ASSERT_EQ(tagged.tags_size(), 1);
  ASSERT_TRUE(tag(stub, friction, "current").ok());
  v1::GetModelRequest get;
  get.set_name("gel");
  v1::GetModelResponse model;
  ASSERT_TRUE(stub.GetModel(call_context().get(), get, &model).ok());
  EXPECT_EQ(model.summary().stored_size(), 2);
  EXPECT_TRUE(model.summary().rod_friction());

  ASSERT_TRUE(service.scene->LoadScene(call_context().get(), load, &loaded).ok());
  ASSERT_EQ(loaded.outline().model_needs_size(), 2);
  EXPECT_TRUE(holds(loaded.outline().model_needs(0).remark(), "stored model " + contact.substr(0, 12)));
  const auto stored = list(stub);
  EXPECT_EQ(stored.models_size(), 2);
  for (const v1::StoredModel& one : stored.models()) EXPECT_TRUE(one.in_use());
  expect_refused(erase(stub, contact), StatusCode::FAILED_PRECONDITION, v1::ERROR_REASON_IN_USE,
                 "stored model");
  answer_of(*service.scene, &v1::SceneService::Stub::UnloadScene);
  EXPECT_TRUE(erase(stub, contact).ok());
}

TEST(ServiceStoredModels, ATagThatNoModelHasIsRefusedWithASuggestion) {
  const RunningService service;
  v1::ModelService::Stub& stub = *service.model;
  const std::string hash = import(stub, example_contact("gel")).hash();
  ASSERT_TRUE(tag(stub, hash, "soft").ok());
  v1::LoadSceneRequest load;
  load.set_name("explore_bearing");
  load.set_object_model("gel@sotf");
  v1::LoadSceneResponse loaded;
  expect_refused(service.scene->LoadScene(call_context().get(), load, &loaded),
                 StatusCode::FAILED_PRECONDITION, v1::ERROR_REASON_WRONG_STATE, "model name");
  load.set_object_model("gel@soft");
  EXPECT_TRUE(service.scene->LoadScene(call_context().get(), load, &loaded).ok());
  EXPECT_EQ(loaded.outline().object_model(), "gel@soft");
  v1::UntagStoredModelRequest untag;
  untag.set_hash(hash);
  untag.set_tag("soft");
  v1::StoredModel stored;
  EXPECT_TRUE(stub.UntagStoredModel(call_context().get(), untag, &stored).ok());
  EXPECT_TRUE(stored.tags().empty());
  EXPECT_EQ(tag(stub, hash, "a@b").error_code(), StatusCode::INVALID_ARGUMENT);
}

TEST(ServiceStoredModels, WhatWasIdentifiedOfTheRigIsExplained) {
  const RunningService service;
  v1::ModelService::Stub& stub = *service.model;
  const v1::RigInfo rig = answer_of(*service.rig, &v1::RigService::Stub::GetRigInfo);
  rt::IdentifiedModel tool = example_of_rig(example_tool(11.25));
  tool.device = rig.device().model();
  tool.sensor = rig.sensor().model();
  ASSERT_TRUE(tag(stub, import(stub, tool).hash(), "current").ok());
  v1::ExplainSceneRequest request;
  request.set_name("explore_bearing");
  const v1::SceneOutline outline = answer_of(*service.scene, &v1::SceneService::Stub::ExplainScene, request);
  EXPECT_TRUE(holds(outline.resolved_toml(), "mass_g = 11.25\n"));
  ASSERT_EQ(outline.remarks_size(), 2);
  EXPECT_EQ(outline.remarks(1),
            "the scene is for a ball bearing, the simulated tool is a rod: set tip in [rig.sim]");
  EXPECT_TRUE(outline.remarks(0).starts_with("tool.mass_g = 11.25 g: from stored model "))
      << outline.remarks(0);
  EXPECT_FALSE(outline.has_obstacle());
}

TEST(ServiceStoredModels, AStoreThatCannotBeUsedKeepsTheDaemonFromStarting) {
  const TemporaryFolder folder;
  const std::string path = folder.write("notes.txt", std::string(200, 'x'));
  for (const bool check : {false, true}) {
    std::vector<std::string> arguments{"--listen", "127.0.0.1:0", "--model-store", path};
    if (check) arguments.emplace_back("--check-config");
    DaemonProcess process(arguments);
    EXPECT_EQ(process.wait(), 2);
    EXPECT_TRUE(holds(process.errors(), "not a store of models"));
  }
  // A check makes nothing.
  DaemonProcess process({"--model-store", folder.path("new/models.sqlite"), "--check-config"});
  EXPECT_EQ(process.wait(), 0) << process.errors();
  EXPECT_TRUE(holds(process.output(), "store = \"" + folder.path("new/models.sqlite") + "\""));
  DaemonProcess nowhere({"--listen", "127.0.0.1:0", "--model-store", path + "/models.sqlite"});
  EXPECT_EQ(nowhere.wait(), 2);
}

/// A store in a file, and another process that keeps it locked.
TEST(ServiceStoredModels, OfALockedStoreAreRefusedInTimeAndScenesThatNeedNoneAreLoaded) {
  const TemporaryFolder folder;
  server::DaemonConfig config = quiet_config();
  config.model_store = folder.path("models.sqlite");
  const RunningService service(config);
  const std::string hash = import(*service.model, example_contact("sponge")).hash();
  std::optional<SQLite::Database> other(std::in_place, *config.model_store, SQLite::OPEN_READWRITE);
  other->exec("BEGIN EXCLUSIVE");

  v1::TagStoredModelRequest request;
  request.set_hash(hash);
  request.set_tag("current");
  v1::StoredModel stored;
  const auto context = call_context(std::chrono::milliseconds(300));
  const grpc::Status status = service.model->TagStoredModel(context.get(), request, &stored);
  EXPECT_TRUE(status.error_code() == StatusCode::UNAVAILABLE ||
              status.error_code() == StatusCode::DEADLINE_EXCEEDED)
      << status.error_message();
  EXPECT_TRUE(service.load("tap_1d").ok());
  other.reset();
  EXPECT_TRUE(tag(*service.model, hash, "current").ok());
}

}  // namespace
}  // namespace hapticd::test
