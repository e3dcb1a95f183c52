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

TEST(CalibrationRunner, TakesABoundedNumberOfPosesOfEachKind) {
  Session session(std::move(*sim::SimulatedRig::create({})), hapticd::test::quiet_loop());
  TelemetryHub hub(session.engine());
  CalibrationStore store("", "rig");
  CalibrationRunner runner(session, hub, store);
  session.start();
  CalibrationRequest request;
  request.recorded = true;
  request.time_limit_s = 1800.0;
  ASSERT_TRUE(runner.start(request));
  std::vector<calibration::RigPose> rig(CalibrationRunner::kMaxRigPoses + 1);
  for (std::size_t i = 0; i < rig.size(); ++i) rig[i].time_s = 1e-3 * static_cast<double>(i);
  auto refused = runner.push({}, rig);
  ASSERT_TRUE(refused);
  EXPECT_EQ(refused->kind, RefusalKind::kResourceExhausted);
  EXPECT_EQ(refused->error.value, "500001");
  EXPECT_EQ(refused->error.limit, "at most 500000");
  refused = runner.push(std::vector<calibration::ReferencePose>(CalibrationRunner::kMaxPoses + 1), {});
  ASSERT_TRUE(refused);
  EXPECT_EQ(refused->error.limit, "at most 200000");
  EXPECT_EQ(runner.cancel(Caller{})->state, CalibrationState::kCancelled);
  session.stop();
}

}  // namespace
}  // namespace hapticd::server
