#include <gtest/gtest.h>

#include <algorithm>
#include <mutex>
#include <thread>
#include <vector>

#include "tests/integration/error_detail.h"
#include "tests/integration/running_service.h"
#include "tests/support/temporary_folder.h"

namespace hapticd::test {
namespace {

TEST(ServiceScenes, LoadExplainListUnload) {
  const RunningService service;
  v1::LoadSceneResponse loaded;
  ASSERT_TRUE(service.load("tap_1d", &loaded).ok());
  EXPECT_EQ(loaded.outline().name(), "tap_1d");
  EXPECT_EQ(loaded.outline().tip(), "rod");
  EXPECT_FALSE(loaded.outline().stages().empty());
  const auto& groups = loaded.outline().telemetry_groups();
  for (const char* group : {"sample", "motion", "contact", "deformation", "target", "control", "guard",
                            "timing", "truth", "zero"}) {
    EXPECT_NE(std::find(groups.begin(), groups.end(), group), groups.end()) << group;
  }
  EXPECT_EQ(groups.size(), 10) << "no direction, fusion or passivity in one dimension";
  EXPECT_EQ(loaded.outline().target_law(), "linear");
  EXPECT_TRUE(loaded.outline().model_needs().empty());
  EXPECT_EQ(service.await([&](const v1::RigState& s) { return s.tick() >= loaded.effective_tick(); }).scene(),
            "tap_1d");

  const v1::ListScenesResponse scenes = answer_of(*service.scene, &v1::SceneService::Stub::ListScenes);
  ASSERT_EQ(scenes.scenes_size(), 9);
  for (const v1::SceneSummary& scene : scenes.scenes()) {
    EXPECT_EQ(scene.loaded(), scene.name() == "tap_1d") << scene.name();
  }

  // The resolved text is a scene by itself and means the same.
  v1::ExplainSceneRequest request;
  request.set_toml(loaded.outline().resolved_toml());
  v1::SceneOutline outline = answer_of(*service.scene, &v1::SceneService::Stub::ExplainScene, request);
  EXPECT_TRUE(outline.has_cost()) << "only reported where nothing waits for it";
  outline.clear_cost();
  EXPECT_EQ(outline.SerializeAsString(), loaded.outline().SerializeAsString());

  v1::UnloadSceneResponse unloaded = answer_of(*service.scene, &v1::SceneService::Stub::UnloadScene);
  EXPECT_GT(unloaded.effective_tick(), loaded.effective_tick());
  const v1::RigState idle =
      service.await([&](const v1::RigState& s) { return s.tick() >= unloaded.effective_tick(); });
  EXPECT_EQ(idle.scene(), "");
  EXPECT_EQ(idle.target_stiffness_n_per_mm(), 0.0);
  EXPECT_TRUE(service.scene->UnloadScene(call_context().get(), {}, &unloaded).ok())
      << "also when none is loaded";
}

TEST(ServiceScenes, ARefusedSceneLeavesTheLoadedOneInPlace) {
  const RunningService service(config_with_scene("wall"));
  expect_refused(service.load_toml("name = \"mine\"\n\n[target]\nstifness = 0.3\n"),
                 grpc::StatusCode::INVALID_ARGUMENT, v1::ERROR_REASON_UNKNOWN_KEY, "scene text, line 4");
  expect_refused(service.load("tap1d"), grpc::StatusCode::NOT_FOUND, v1::ERROR_REASON_NOT_FOUND,
                 "scene name");
  v1::LoadSceneResponse response;
  expect_refused(service.scene->LoadScene(call_context().get(), {}, &response),
                 grpc::StatusCode::INVALID_ARGUMENT, v1::ERROR_REASON_INVALID, "LoadSceneRequest.source");
  expect_refused(service.load_toml("name = \"wild\"\n[control]\nproportional_gain = 3.9\n"),
                 grpc::StatusCode::INVALID_ARGUMENT, "scene 'wild'");
  expect_refused_saying(service.load_toml("name = \"model\"\nobject_model = \"sponge\"\n"),
                        grpc::StatusCode::FAILED_PRECONDITION, "the scene has no use for a model");
  EXPECT_EQ(service.state().scene(), "wall");
}

TEST(ServiceScenes, ASceneOfTheFolderIsLoadedAtTheStart) {
  const TemporaryFolder folder;
  folder.write("soft.toml", "[target]\nstiffness_n_per_mm = 0.125\n");
  server::DaemonConfig config = quiet_config();
  config.scene_folder = folder.path();
  config.scene = "soft";
  const RunningService service(config);
  const v1::RigState state = service.await([](const v1::RigState& s) { return s.tick() > 0; });
  EXPECT_EQ(state.scene(), "soft");
  EXPECT_EQ(state.target_stiffness_n_per_mm(), 0.125);
}

TEST(ServiceScenes, ScenesLoadedByManyAtOnceAllTakeEffectOneAfterTheOther) {
  const RunningService service;
  std::vector<std::thread> clients;
  std::mutex mutex;
  std::vector<std::uint64_t> ticks;
  for (int client = 0; client < 8; ++client) {
    clients.emplace_back([&service, &mutex, &ticks, client] {
      for (int i = 0; i < 10; ++i) {
        v1::LoadSceneResponse response;
        EXPECT_TRUE(ok(service.load(client % 2 == 0 ? "tap_1d" : "wall", &response)));
        const std::lock_guard lock(mutex);
        ticks.push_back(response.effective_tick());
      }
    });
  }
  for (std::thread& client : clients) client.join();
  EXPECT_EQ(ticks.size(), 80U);
  EXPECT_TRUE(service.state().loop().running());
}

}  // namespace
}  // namespace hapticd::test
