// Calibrations without the network.

#include "server/calibration/run/calibration_runner.h"

#include <gtest/gtest.h>

#include "hal/sim/simulated_rig.h"
#include "tests/support/quiet_loop.h"
#include "tests/support/room_for_threads.h"

namespace hapticd::server {
namespace {

class CalibrationRunnerTest : public testing::Test {
 protected:
  CalibrationRunnerTest() {
    session_.start();
    request_.recorded = true;
  }
  ~CalibrationRunnerTest() override { session_.stop(); }

 private:
  Session session_{std::move(*sim::SimulatedRig::create({})), hapticd::test::quiet_loop()};
  TelemetryHub hub_{session_.engine()};
  CalibrationStore store_{"", "rig"};

 protected:
  CalibrationRunner runner_{session_, hub_, store_};
  CalibrationRequest request_;
};

TEST_F(CalibrationRunnerTest, ReportsNoneThatHasNoThread) {
  {
    const hapticd::test::RoomForThreads none(0);
    const auto refused = runner_.start(request_);
    ASSERT_FALSE(refused);
    EXPECT_EQ(refused.refusal().kind, RefusalKind::kResourceExhausted);
    EXPECT_EQ(refused.refusal().error.where, "threads");
  }
  EXPECT_EQ(runner_.report("", 0, Caller{}).refusal().kind, RefusalKind::kNotFound);
  EXPECT_TRUE(runner_.start(request_));
  EXPECT_EQ(runner_.cancel(Caller{})->state, CalibrationState::kCancelled);
}

TEST_F(CalibrationRunnerTest, TakesABoundedNumberOfPosesOfEachKind) {
  request_.time_limit_s = 1800.0;
  ASSERT_TRUE(runner_.start(request_));
  std::vector<calibration::RigPose> rig(CalibrationRunner::kMaxRigPoses + 1);
  for (std::size_t i = 0; i < rig.size(); ++i) rig[i].time_s = 1e-3 * static_cast<double>(i);
  auto refused = runner_.push({}, rig);
  ASSERT_TRUE(refused);
  EXPECT_EQ(refused->kind, RefusalKind::kResourceExhausted);
  EXPECT_EQ(refused->error.value, "500001");
  EXPECT_EQ(refused->error.limit, "at most 500000");
  refused = runner_.push(std::vector<calibration::ReferencePose>(CalibrationRunner::kMaxPoses + 1), {});
  ASSERT_TRUE(refused);
  EXPECT_EQ(refused->error.limit, "at most 200000");
  EXPECT_EQ(runner_.cancel(Caller{})->state, CalibrationState::kCancelled);
}

}  // namespace
}  // namespace hapticd::server
