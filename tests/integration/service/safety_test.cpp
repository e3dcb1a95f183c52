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
      EXPECT_EQ(service.await(is_latched).guard_fault(), v1::GUARD_FAULT_STOPPED);
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

}  // namespace
}  // namespace hapticd::test
