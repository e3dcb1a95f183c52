#include "server/turntable/interlock.h"

#include <gtest/gtest.h>

#include <cmath>

namespace hapticd::server {
namespace {

using std::chrono::milliseconds;

class TheInterlock : public testing::Test {
 protected:
  /// What it says of a loop that goes on as it should.
  std::string ask(rt::TickRecord record, bool free = true) {
    record.tick = ++tick_;
    now_ += milliseconds(1);
    const auto why_not = interlock_.why_not(record, free, now_);
    return why_not ? why_not->what : "";
  }
  InterlockConfig config_;
  Interlock interlock_{config_};
  std::uint64_t tick_ = 0;
  Interlock::Clock::time_point now_ = Interlock::Clock::now();
};

TEST_F(TheInterlock, LetsAFreeToolBe) {
  EXPECT_EQ(ask({}), "");
}

TEST_F(TheInterlock, HoldsInContact) {
  EXPECT_EQ(ask({}, false), "the tool is in contact");
}

TEST_F(TheInterlock, HoldsWhileTheDeviceRenders) {
  rt::TickRecord record;
  record.device_command_n = {0.03, 0.0, 0.03};
  EXPECT_EQ(ask(record), "");
  record.device_command_n = {0.04, 0.0, 0.04};
  EXPECT_EQ(ask(record), "the device renders force");
  record.device_command_n.x = std::nan("");
  EXPECT_EQ(ask(record), "the device renders force");
}

TEST_F(TheInterlock, HoldsUnderLoadThatNoSceneSees) {
  rt::TickRecord record;
  record.sensor_force_n = {0.0, 0.0, 0.6};
  EXPECT_EQ(ask(record), "the tool is under load");
  record.sensor_force_n = {};
  record.sample_status = hal::sample_status::kForceSaturated;
  EXPECT_EQ(ask(record), "the tool is under load");
}

TEST_F(TheInterlock, HoldsWhileTheGuardIsLatchedOrResuming) {
  rt::TickRecord record;
  record.guard_state = rt::GuardState::kLatched;
  EXPECT_EQ(ask(record), "the guard is latched");
  record.guard_state = rt::GuardState::kResuming;
  EXPECT_EQ(ask(record), "the device's force is returning after a clear");
}

TEST_F(TheInterlock, OneTickWithoutASampleIsNoSilence) {
  EXPECT_EQ(ask({}), "");
  rt::TickRecord record;
  record.sample_status = hal::sample_status::kForceMissing;
  EXPECT_EQ(ask(record), "");
  now_ += milliseconds(150);
  EXPECT_NE(ask(record).find("the force sensor says nothing"), std::string::npos);
}

TEST_F(TheInterlock, ASensorThatNeverSpokeHoldsUnlessReportedOtherwise) {
  rt::TickRecord record;
  record.sample_status = hal::sample_status::kForceLost;
  EXPECT_NE(ask(record).find("the force sensor says nothing"), std::string::npos);
  config_.turn_without_sensor = true;
  Interlock blind(config_);
  EXPECT_FALSE(blind.why_not(record, true, now_));
}

TEST_F(TheInterlock, HoldsWhenTheLoopStandsStill) {
  EXPECT_EQ(ask({}), "");
  rt::TickRecord record;
  record.tick = tick_;
  EXPECT_FALSE(interlock_.why_not(record, true, now_ + milliseconds(200)));
  const auto why_not = interlock_.why_not(record, true, now_ + milliseconds(300));
  ASSERT_TRUE(why_not);
  EXPECT_EQ(why_not->what, "the loop has stopped: contact would not be noticed");
}

}  // namespace
}  // namespace hapticd::server
