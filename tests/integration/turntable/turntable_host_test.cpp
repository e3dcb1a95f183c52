#include "server/turntable/turntable_host.h"

#include <gtest/gtest.h>

#include <chrono>
#include <cmath>
#include <string>
#include <thread>
#include <utility>

#include "hal/sim/simulated_rig.h"
#include "server/rig_file/turntable_factory.h"
#include "server/rig_file/turntable_map.h"
#include "server/scene/scene_host.h"
#include "server/session/session.h"
#include "server/telemetry/telemetry_hub.h"
#include "tests/emulators/modbus/emulated_drive.h"
#include "tests/support/eventually.h"
#include "tests/support/quiet_loop.h"
#include "tests/support/value_of.h"

namespace hapticd::server {
namespace {

/// The simulated rig and an emulated drive behind Modbus TCP, without the network of the service.
class AHost : public testing::Test {
 protected:
  AHost() {
    hub.start();
    session.start();
  }
  ~AHost() override {
    host.shutdown();
    session.stop();
    hub.stop();
  }

  static std::unique_ptr<hal::Rig> rig() {
    sim::SimulationConfig config{.real_time = true};
    return std::move(*sim::SimulatedRig::create(config));
  }
  static InterlockConfig patient() {
    InterlockConfig config;
    config.sensor_silence_s = config.loop_silence_s = 10.0;
    return config;
  }
  std::unique_ptr<hal::Turntable> table() const {
    TurntableConfig config;
    config.kind = TurntableChoice::kModbus;
    config.modbus.map = *find_turntable_map("plain_drive");
    config.modbus.link.host = "127.0.0.1";
    config.modbus.link.port = drive.port();
    config.modbus.link.response_timeout_s = 0.5;
    config.settings.stale_after_s = 1.5;
    config.settings.stations = {{"sponge", 0.0, "sponge_block"}, {"rubber", 20.0, "rubber_ball"}};
    return std::move(*make_turntable(config));
  }
  Outcome<hal::TurntableStatus> move(double angle_deg) {
    return host.move_to({angle_deg, ""}, {}, Caller{}, [](const hal::TurntableStatus&) { return true; });
  }
  Outcome<hal::TurntableStatus> home() {
    return host.home(Caller{}, [](const hal::TurntableStatus&) { return true; });
  }

  /// The faults present in a tick that began after this call.
  rt::FaultSet reported_faults() {
    const std::uint64_t now = session.last_tick();
    rt::TickRecord record = hub.latest();
    while (record.tick <= now + 1) {
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
      record = hub.latest();
    }
    return record.faults_present;
  }

  test::EmulatedDrive drive{test::EmulatedDrive::Options{}};
  Session session{rig(), hapticd::test::quiet_loop()};
  TelemetryHub hub{session.engine()};
  SceneHost scenes{session, SceneLibrary(""), ModelLibrary("")};
  TurntableHost host{table(), patient(), session, scenes, hub};
};

TEST_F(AHost, RequiresAStationOnlyWhenAskedAndOpensThePortThen) {
  EXPECT_EQ(drive.requests(), 0U);
  auto refusal = host.require_station("spnge");
  ASSERT_TRUE(refusal);
  EXPECT_EQ(refusal->error.remedy, "did you mean 'sponge'?");
  EXPECT_EQ(drive.requests(), 0U);

  refusal = host.require_station("sponge");
  ASSERT_TRUE(refusal);
  EXPECT_EQ(refusal->kind, RefusalKind::kFailedPrecondition);
  EXPECT_EQ(refusal->error.what, "the turntable does not stand at the station that is needed");
  EXPECT_EQ(refusal->error.remedy,
            "home it (hapticctl turntable home), then hapticctl turntable goto sponge");
  EXPECT_GT(drive.requests(), 0U);

  ASSERT_TRUE(home());
  EXPECT_FALSE(host.require_station("sponge"));
  refusal = host.require_station("rubber");
  ASSERT_TRUE(refusal);
  EXPECT_EQ(refusal->error.remedy, "bring it there: hapticctl turntable goto rubber");
  ASSERT_TRUE(move(20.0));
  EXPECT_FALSE(host.require_station("rubber"));
  EXPECT_EQ(session.simulation()->object(), "rubber_ball");
}

TEST_F(AHost, AnAngleBeyondItsRangeIsNotOneThatIsNotFinite) {
  const auto beyond = hapticd::test::refusal_of(move(1e6));
  EXPECT_EQ(beyond.kind, RefusalKind::kOutOfRange);
  EXPECT_EQ(beyond.error.code, hal::ErrorCode::kOutOfRange);
  for (const double angle_deg : {std::nan(""), HUGE_VAL}) {
    const auto refused = hapticd::test::refusal_of(move(angle_deg));
    EXPECT_EQ(refused.kind, RefusalKind::kInvalidArgument);
    EXPECT_EQ(refused.error.code, hal::ErrorCode::kNotFinite);
  }
}

TEST_F(AHost, AStationIsNotBelievedWithoutAFreshPosition) {
  ASSERT_TRUE(home());
  drive.set_faults({.silent = true});
  EXPECT_TRUE(test::eventually([&] { return host.table()->status().state == hal::TurntableState::kLost; }));
  const auto refusal = hapticd::test::error_of(host.require_station("sponge"));
  EXPECT_NE(refusal.error.value.find("lost"), std::string::npos);
}

TEST_F(AHost, TellsFaultsOfMotions) {
  ASSERT_TRUE(home());
  drive.hold(true);
  EXPECT_EQ(hapticd::test::refusal_of(move(20.0)).kind, RefusalKind::kAborted);
  EXPECT_EQ(reported_faults(), rt::set_of(rt::GuardFault::kTurntableStalled));
  EXPECT_EQ(reported_faults(), rt::set_of(rt::GuardFault::kTurntableStalled)) << "for as long as it lasts";
  drive.hold(false);
  ASSERT_TRUE(host.clear_alarm(Caller{}));
  EXPECT_EQ(reported_faults(), 0U);
  drive.set_faults({.exception_on_write = 3});
  EXPECT_FALSE(move(20.0));
  EXPECT_EQ(reported_faults(), rt::set_of(rt::GuardFault::kTurntableAlarm));
  drive.set_faults({});
  ASSERT_TRUE(move(20.0));
  EXPECT_EQ(reported_faults(), 0U) << "the next motion begins again";
  EXPECT_EQ(hub.latest().guard_state, rt::GuardState::kRendering) << "they are warnings";
}

TEST_F(AHost, ATableLostOnTheWayTakesTheForceUntilItIsSeenTo) {
  ASSERT_TRUE(home());
  bool began = false;
  const auto lost = host.move_to({170.0, ""}, {20.0, 0.0}, Caller{}, [&](const hal::TurntableStatus& status) {
    if (status.state == hal::TurntableState::kMoving && !std::exchange(began, true))
      drive.set_faults({.silent = true});
    return true;
  });
  ASSERT_FALSE(lost);
  EXPECT_EQ(reported_faults(), rt::set_of(rt::GuardFault::kTurntableLost));
  EXPECT_EQ(hub.latest().guard_fault, rt::GuardFault::kTurntableLost);
  rt::EngineCommand clear;
  clear.kind = rt::EngineCommand::Kind::kClear;
  EXPECT_EQ(session.engine().execute(clear, std::chrono::seconds(20)).status,
            rt::EngineOutcome::Status::kFaultPersists);
  ASSERT_TRUE(host.disengage());
  EXPECT_EQ(reported_faults(), 0U);
  EXPECT_EQ(session.engine().execute(clear, std::chrono::seconds(20)).status,
            rt::EngineOutcome::Status::kApplied);
}

TEST_F(AHost, ADriveThatIsNotThereIsUnavailable) {
  drive.set_faults({.refuse_connections = true});
  EXPECT_EQ(hapticd::test::refusal_of(home()).kind, RefusalKind::kUnavailable);
  EXPECT_FALSE(scenes.reserved());
}

TEST_F(AHost, WhoeverLosesInterestStopsTheTable) {
  ASSERT_TRUE(home());
  int reported = 0;
  const auto left = hapticd::test::refusal_of(
      host.move_to({170.0, ""}, {20.0, 0.0}, Caller{},
                   [&reported](const hal::TurntableStatus&) { return ++reported < 3; }));
  EXPECT_EQ(left.kind, RefusalKind::kCancelled);
  EXPECT_FALSE(drive.motor().moving());
  EXPECT_FALSE(scenes.reserved());
  EXPECT_EQ(reported_faults(), 0U);
}

}  // namespace
}  // namespace hapticd::server
