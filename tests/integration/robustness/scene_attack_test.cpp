// Limits that a client may not lift by a separate scene.

#include <gtest/gtest.h>

#include "tests/integration/error_detail.h"
#include "tests/integration/running_service.h"

namespace hapticd::test {
namespace {

constexpr const char* kHead = "name = \"mine\"\nkind = \"tap_1d\"\n";
constexpr const char* kAttack =
    "[structure]\ncompensation = false\n"
    "[target]\nmax_stiffness_n_per_mm = 1000\n"
    "[guard]\nmax_power_w = 100\nsensor_stale_after_ms = 1000\nloop_gap_ms = "
    "0\n"
    "resume_ramp_s = 0\n";

TEST(SceneAttack, AsAWholeIsRefusedAndChangesNothing) {
  const RunningService service(config_with_scene("tap_1d"));
  const grpc::Status status = service.load_toml(std::string(kHead) + kAttack);
  EXPECT_EQ(status.error_code(), grpc::StatusCode::OUT_OF_RANGE) << status.error_message();
  const v1::ErrorDetail detail = detail_of(status);
  EXPECT_NE(detail.where().find("scene 'mine', "), std::string::npos) << detail.DebugString();
  EXPECT_NE(detail.limit().find("[guard]"), std::string::npos) << detail.DebugString();
  EXPECT_EQ(service.state().scene(), "tap_1d");
  v1::ExplainSceneRequest request;
  request.set_toml(std::string(kHead) + kAttack);
  v1::SceneOutline outline;
  EXPECT_EQ(service.scene->ExplainScene(call_context().get(), request, &outline).error_code(),
            grpc::StatusCode::OUT_OF_RANGE);

  v1::SetTargetRequest target;
  target.set_stiffness_n_per_mm(1000.0);
  v1::SetTargetResponse set;
  ASSERT_TRUE(service.set_target(target, &set).ok());
  EXPECT_EQ(set.granted_n_per_mm(), 1.0);
  EXPECT_EQ(set.limiting_reason(), v1::LIMITING_REASON_SCENE_MAXIMUM);
}

TEST(SceneAttack, EachOfItsKeysIsRefusedByName) {
  const RunningService service;
  for (const auto& [lines, key] :
       {std::pair("[target]\nmax_stiffness_n_per_mm = 1000\n", "target.max_stiffness_n_per_mm"),
        {"[guard]\nmax_power_w = 100\n", "guard.max_power_w"},
        {"[guard]\nsensor_stale_after_ms = 1000\n", "guard.sensor_stale_after_ms"},
        {"[guard]\nloop_gap_ms = 0\n", "guard.loop_gap_ms"},
        {"[guard]\nloop_gap_ms = 1000\n", "guard.loop_gap_ms"},
        {"[guard]\nresume_ramp_s = 0\n", "guard.resume_ramp_s"},
        {"[target]\nramp_s = 0\n", "target.ramp_s"}}) {
    expect_refused(service.load_toml(std::string(kHead) + lines), grpc::StatusCode::OUT_OF_RANGE,
                   std::string("scene 'mine', ") + key);
  }
  // A device taken as rigid is allowed, and lifts no limit of the target.
  ASSERT_TRUE(service.load_toml(std::string(kHead) + "[structure]\ncompensation = false\n").ok());
  v1::SetTargetRequest target;
  target.set_stiffness_n_per_mm(1000.0);
  v1::SetTargetResponse set;
  ASSERT_TRUE(service.set_target(target, &set).ok());
  EXPECT_EQ(set.granted_n_per_mm(), 1.0);
}

TEST(SceneAttack, KeysByTheThousandAreRefusedAndTheServiceGoesOn) {
  const RunningService service;
  std::string parts;
  for (int i = 0; i < 40000; ++i) parts += "a.";
  for (const std::string& text : {parts + "a = 1\n", "[" + parts + "a]\n", "[[" + parts + "a]]\n"}) {
    expect_refused(service.load_toml(kHead + text), grpc::StatusCode::INVALID_ARGUMENT, "scene text, line 3");
    v1::ExplainSceneRequest request;
    request.set_toml(kHead + text);
    v1::SceneOutline outline;
    EXPECT_EQ(service.scene->ExplainScene(call_context().get(), request, &outline).error_code(),
              grpc::StatusCode::INVALID_ARGUMENT);
  }
  EXPECT_TRUE(service.state().loop().running());
}

}  // namespace
}  // namespace hapticd::test
