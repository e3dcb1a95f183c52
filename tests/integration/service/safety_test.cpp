#include <gtest/gtest.h>

#include "tests/integration/running_service.h"

namespace hapticd::test {
namespace {

TEST(ServiceSafety, StopLatchesAndClearResumes) {
  const RunningService service(config_with_scene("tap_1d"));
  for (int round = 0; round < 20; ++round) {  // a clear sent right after a stop must not overtake it
    v1::StopRequest request;
    request.set_reason("a test\nwith two lines");
    const v1::StopResponse stopped = answer_of(*service.safety, &v1::SafetyService::Stub::Stop, request);
    EXPECT_EQ(stopped.guard_state(), v1::GUARD_STATE_LATCHED);
    EXPECT_EQ(stopped.guard_fault(), v1::GUARD_FAULT_STOPPED);
    if (round == 0) {
      const v1::RigState latched =
          service.await([](const v1::RigState& s) { return s.guard_state() == v1::GUARD_STATE_LATCHED; });
      EXPECT_EQ(latched.guard_fault(), v1::GUARD_FAULT_STOPPED);
    }
    const v1::ClearResponse cleared = answer_of(*service.safety, &v1::SafetyService::Stub::Clear);
    EXPECT_EQ(cleared.cleared_fault(), v1::GUARD_FAULT_STOPPED);
    EXPECT_EQ(cleared.guard_state(), v1::GUARD_STATE_RESUMING);
    const v1::RigState state =
        service.await([&](const v1::RigState& s) { return s.tick() >= cleared.effective_tick(); });
    EXPECT_NE(state.guard_state(), v1::GUARD_STATE_LATCHED) << "round " << round;
  }
  service.await([](const v1::RigState& s) { return s.guard_state() == v1::GUARD_STATE_RENDERING; });
  const v1::ClearResponse nothing = answer_of(*service.safety, &v1::SafetyService::Stub::Clear);
  EXPECT_EQ(nothing.cleared_fault(), v1::GUARD_FAULT_NONE);
  EXPECT_EQ(nothing.guard_state(), v1::GUARD_STATE_RENDERING);
}

TEST(ServiceSafety, NoForceReachesTheDeviceWhileStopped) {
  const RunningService service(config_with_scene("tap_1d"));
  service.press(2.0);
  v1::SubscribeRequest request;
  request.add_groups(v1::FIELD_GROUP_GUARD);
  grpc::ClientContext context;
  const auto reader = service.telemetry->Subscribe(&context, request);
  v1::TelemetryBatch batch;
  ASSERT_TRUE(reader->Read(&batch));
  ASSERT_TRUE(service.stop().ok());
  int latched = 0;
  while (latched < 200 && reader->Read(&batch)) {
    for (const v1::TelemetrySample& sample : batch.samples()) {
      if (sample.guard().state() != v1::GUARD_STATE_LATCHED) {
        EXPECT_EQ(latched, 0) << "once latched it stays so";
        continue;
      }
      ++latched;
      EXPECT_EQ(sample.guard().device_command_n().x(), 0.0);
      EXPECT_EQ(sample.guard().device_command_n().y(), 0.0);
      EXPECT_EQ(sample.guard().device_command_n().z(), 0.0);
    }
  }
  EXPECT_GE(latched, 200);
  context.TryCancel();
  reader->Finish();
}

}  // namespace
}  // namespace hapticd::test
