// Calibrations without the network.

#include "server/calibration/run/calibration_runner.h"

#include <gtest/gtest.h>

#include "hal/sim/simulated_rig.h"
#include "tests/support/quiet_loop.h"
#include "tests/support/room_for_threads.h"

namespace hapticd::server {
namespace {

TEST(CalibrationRunner, ReportsNoneThatHasNoThread) {
  Session session(std::move(*sim::SimulatedRig::create({})), hapticd::test::quiet_loop());
  TelemetryHub hub(session.engine());
  CalibrationStore store("", "rig");
  CalibrationRunner runner(session, hub, store);
  session.start();
  CalibrationRequest request;
  request.recorded = true;
  {
    const hapticd::test::RoomForThreads none(0);
    const auto refused = runner.start(request);
    ASSERT_FALSE(refused);
    EXPECT_EQ(refused.refusal().kind, RefusalKind::kResourceExhausted);
    EXPECT_EQ(refused.refusal().error.where, "threads");
  }
  EXPECT_EQ(runner.report("", 0, Caller{}).refusal().kind, RefusalKind::kNotFound);
  EXPECT_TRUE(runner.start(request));
  EXPECT_EQ(runner.cancel(Caller{})->state, CalibrationState::kCancelled);
  session.stop();
}

}  // namespace
}  // namespace hapticd::server
