#include <gtest/gtest.h>

#include <cmath>
#include <set>

#include "tests/integration/error_detail.h"
#include "tests/integration/running_service.h"
#include "tests/support/temporary_folder.h"

namespace hapticd::test {
namespace {

constexpr const char* kRodWithoutModel =
    "name = \"mine\"\nkind = \"explore\"\nobject_model = \"foam_bal_3d\"\n[tool]\ntip = \"rod\"\n";
constexpr const char* kMissing =
    "the scene needs a model that there is not: creep law of 'foam_bal_3d', friction of the rod of "
    "'foam_bal_3d'";

v1::ExplainSceneRequest explain(const std::string& name, const std::string& model = {}) {
  v1::ExplainSceneRequest request;
  request.set_name(name);
  request.set_object_model(model);
  return request;
}

v1::SceneOutline outline_of(const RunningService& service, const v1::ExplainSceneRequest& request) {
  return answer_of(*service.scene, &v1::SceneService::Stub::ExplainScene, request);
}

grpc::Status load_with(const RunningService& service, const std::string& name, const std::string& model,
                       v1::LoadSceneResponse* response = nullptr) {
  v1::LoadSceneRequest request;
  request.set_name(name);
  request.set_object_model(model);
  v1::LoadSceneResponse unused;
  return service.scene->LoadScene(call_context().get(), request, response != nullptr ? response : &unused);
}

double norm(const v1::Vector3& v) {
  return std::hypot(v.x(), v.y(), v.z());
}

double dot(const v1::Vector3& a, const v1::Vector3& b) {
  return a.x() * b.x() + a.y() * b.y() + a.z() * b.z();
}

TEST(ServiceExplore, AMissingModelIsRefusedByNameAndNothingChanges) {
  const RunningService service;
  v1::LoadSceneResponse loaded;
  ASSERT_TRUE(service.load("tap_1d", &loaded).ok());
  expect_refused(
      service.load_toml(kRodWithoutModel),
      {grpc::StatusCode::FAILED_PRECONDITION, kMissing, "scene 'mine'", "object_model = \"foam_bal_3d\"",
       "foam_ball_3d, rubber_ball_3d, silicone_rest, sponge_cut", "did you mean 'foam_ball_3d'?"});
  service.watch({}, [](const v1::TelemetrySample& sample) {
    EXPECT_EQ(sample.scene_generation(), 1U) << "no scene was exchanged";
    EXPECT_TRUE(sample.has_contact());
    return false;
  });
  EXPECT_EQ(service.state().scene(), "tap_1d");
}

TEST(ServiceExplore, AModelThatLacksAPartIsRefusedByThatPart) {
  const TemporaryFolder folder;
  folder.write("slippery.toml", "[rod_friction]\nkinetic = 0.5\npresliding_mm = 1\nviscous_n_s_per_mm = 0\n");
  server::DaemonConfig config = quiet_config();
  config.model_folder = folder.path();
  const RunningService service(config);
  const grpc::Status status = load_with(service, "explore_rod", "slippery");
  EXPECT_EQ(status.error_code(), grpc::StatusCode::FAILED_PRECONDITION);
  EXPECT_EQ(detail_of(status).what(), "the scene needs a model that there is not: creep law of 'slippery'");
  EXPECT_EQ(detail_of(status).limit(), "foam_ball_3d, rubber_ball_3d, silicone_rest, sponge_cut");
  const v1::SceneOutline outline = outline_of(service, explain("explore_rod", "slippery"));
  ASSERT_EQ(outline.model_needs_size(), 2);
  EXPECT_FALSE(outline.model_needs(0).available());
  EXPECT_EQ(outline.model_needs(0).remark(), "the model has no such part");
  EXPECT_TRUE(outline.model_needs(1).available());
}

TEST(ServiceExplore, IsExplainedWithItsModelsAndItsCost) {
  const RunningService service;
  const v1::SceneOutline outline = outline_of(service, explain("explore_rod"));
  EXPECT_EQ(outline.tip(), "rod");
  EXPECT_EQ(outline.object_model(), "foam_ball_3d");
  EXPECT_FALSE(outline.has_obstacle());
  ASSERT_EQ(outline.models_size(), 2);
  ASSERT_EQ(outline.model_needs_size(), 2);
  for (int i = 0; i < 2; ++i) {
    EXPECT_EQ(outline.model_needs(i).name(), outline.models(i));
    EXPECT_TRUE(outline.model_needs(i).available());
  }
  EXPECT_EQ(outline.models(0), "creep law of 'foam_ball_3d'");
  EXPECT_EQ(outline.models(1), "friction of the rod of 'foam_ball_3d'");
  const std::set<std::string> groups(outline.telemetry_groups().begin(), outline.telemetry_groups().end());
  for (const char* group : {"direction", "fusion", "passivity"}) EXPECT_TRUE(groups.contains(group)) << group;
  ASSERT_TRUE(outline.has_cost());
  EXPECT_TRUE(std::isfinite(outline.cost().median_ns()) && std::isfinite(outline.cost().p999_ns()));
  EXPECT_GT(outline.cost().p999_ns(), 0.0);
  EXPECT_GT(outline.cost().ticks(), 0U);
  EXPECT_NE(outline.cost().remark().find("on this machine"), std::string::npos) << outline.cost().remark();
  EXPECT_EQ(service.state().scene(), "") << "explaining loads nothing";

  // A ball bearing's friction is known: no part of the object's model.
  EXPECT_EQ(outline_of(service, explain("explore_bearing")).models_size(), 1);
}

TEST(ServiceExplore, IsExplainedWithoutItsModelToo) {
  const RunningService service;
  v1::ExplainSceneRequest request;
  request.set_toml(kRodWithoutModel);
  const v1::SceneOutline outline = outline_of(service, request);
  EXPECT_FALSE(outline.stages().empty());
  EXPECT_FALSE(outline.has_cost()) << "what cannot be composed cannot be measured";
  ASSERT_EQ(outline.model_needs_size(), 2);
  for (const v1::ModelNeed& need : outline.model_needs()) {
    EXPECT_FALSE(need.available());
    EXPECT_EQ(need.remark(), "there is no such model; did you mean 'foam_ball_3d'?");
  }
  ASSERT_TRUE(outline.has_obstacle());
  EXPECT_EQ(outline.obstacle().what(), kMissing);
  EXPECT_EQ(outline.obstacle().remedy(), "did you mean 'foam_ball_3d'?");
}

TEST(ServiceExplore, AnotherModelMayTakeThePlaceOfTheScenesOwn) {
  const RunningService service;
  const v1::SceneOutline outline = outline_of(service, explain("explore_rod", "rubber_ball_3d"));
  EXPECT_EQ(outline.object_model(), "rubber_ball_3d");
  EXPECT_NE(outline.resolved_toml().find("object_model = \"rubber_ball_3d\""), std::string::npos);
  EXPECT_EQ(outline.models(0), "creep law of 'rubber_ball_3d'");
  v1::LoadSceneResponse loaded;
  ASSERT_TRUE(ok(load_with(service, "explore_rod", "rubber_ball_3d", &loaded)));
  EXPECT_EQ(loaded.outline().object_model(), "rubber_ball_3d");
  EXPECT_FALSE(loaded.outline().has_cost());
  EXPECT_EQ(service.state().scene(), "explore_rod");

  expect_refused(load_with(service, "explore_rod", "../x"), grpc::StatusCode::INVALID_ARGUMENT,
                 v1::ERROR_REASON_INVALID, "object_model");
  EXPECT_EQ(load_with(service, "tap_1d", "foam_ball_3d").error_code(), grpc::StatusCode::FAILED_PRECONDITION)
      << "one dimension has no use for a model";
  EXPECT_EQ(service.state().scene(), "explore_rod");
}

TEST(ServiceExplore, AStrokeIsRenderedAndItsTelemetryHasDirectionFusionAndPassivity) {
  server::DaemonConfig config = quiet_config();
  config.simulation.real_time = false;
  config.simulation.object = "foam_ball_3d";
  config.simulation.tool_mass_g = 12.59;
  config.scene = "explore_rod";
  const RunningService service(config);
  service.set_hand(v1::HAND_PROGRAM_KIND_STROKE, [](v1::HandProgram& stroke) {
    stroke.set_force_n(1.5);
    stroke.set_speed_mm_per_s(60.0);
    stroke.set_stroke_length_mm(20.0);
    stroke.set_repetitions(-1);
  });

  v1::SubscribeRequest request;
  request.set_decimation(5);
  int in_contact = 0;
  int sliding = 0;
  int aligned = 0;
  int pushed = 0;
  service.watch(request, [&](const v1::TelemetrySample& sample) {
    EXPECT_TRUE(sample.has_direction() && sample.has_fusion() && sample.has_passivity());
    EXPECT_EQ(sample.guard().state(), v1::GUARD_STATE_RENDERING);
    if (!sample.contact().in_contact()) {
      EXPECT_EQ(norm(sample.direction().normal()), 0.0) << "there is none";
      return true;
    }
    ++in_contact;
    EXPECT_NEAR(norm(sample.direction().normal()), 1.0, 1e-9);
    EXPECT_GT(sample.fusion().displacement_deviation_mm(), 0.0);
    EXPECT_TRUE(std::isfinite(sample.fusion().law_displacement_mm()));
    EXPECT_TRUE(std::isfinite(sample.passivity().hand_energy_mj()));
    if (sample.direction().sliding_mm_per_s() > 10.0) ++sliding;
    if (norm(sample.guard().device_command_n()) > 0.05) ++pushed;
    if (dot(sample.direction().normal(), sample.truth().normal()) > 0.8) ++aligned;
    EXPECT_NEAR(norm(sample.truth().normal()), 1.0, 1e-6);
    return in_contact < 1000;
  });
  EXPECT_GE(in_contact, 1000);
  EXPECT_GT(sliding, 100);
  EXPECT_GT(pushed, 500);
  EXPECT_GT(aligned, 800) << "most of the time along the surface's normal";
}

}  // namespace
}  // namespace hapticd::test
