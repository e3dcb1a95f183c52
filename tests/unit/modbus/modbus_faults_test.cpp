#include <gtest/gtest.h>

#include <thread>

#include "tests/support/value_of.h"
#include "tests/unit/modbus/driven_rig.h"

namespace hapticd::test {
namespace {

using hal::MotionEnd;
using hal::TurntableState;
using Over = DrivenRig::Over;

/// Impatient, if the fault is that nothing comes; but many answers in a row may be late on a busy machine.
void impatient(modbus::ModbusConfig& config, turntable::TurntableSettings& settings) {
  config.link.response_timeout_s = 0.1;
  settings.stale_after_s = 1.5;
  settings.reconnect_longest_s = 0.2;
  settings.engage_timeout_s = 2.0;
}

/// Faults of the frames, over each transport.
class ModbusFrame : public testing::TestWithParam<std::string> {
 protected:
  Over over() const { return GetParam() == "Tcp" ? Over::kTcp : Over::kRtu; }

  /// Sets the fault while the table is on its way, and sees the motion end lost, the state lost, and all well
  /// again once the fault is gone.
  void lose_and_find(const DriveFaults& faults) {
    DrivenRig rig(over(), EmulatedDrive::Make::kPlain, impatient);
    const auto number = rig.set_off();
    rig.drive.set_faults(faults);
    const hal::TurntableStatus end = rig.await_end_of(number);
    EXPECT_EQ(end.motion.end, MotionEnd::kLost);
    ASSERT_TRUE(end.motion.problem);
    EXPECT_EQ(end.motion.problem->what,
              "contact with the drive was lost on the way: where the table stands is not known");
    rig.await_state(TurntableState::kLost);
    EXPECT_FALSE(rig.table->report().findings.empty());
    EXPECT_EQ(error_of(rig.table->move_to(0.0, {})).what,
              "the table's position is not known: it does not turn without a fresh one");
    rig.drive.set_faults({});
    // What it was doing meanwhile is ended, and it may be turned again.
    rig.await_state(TurntableState::kStanding);
    EXPECT_FALSE(rig.drive.motor().moving());
    EXPECT_EQ(rig.await_end(rig.table->move_to(0.0, {})).motion.end, MotionEnd::kArrived);
  }
};

INSTANTIATE_TEST_SUITE_P(Over, ModbusFrame, testing::Values("Tcp", "Rtu"),
                         [](const auto& one) { return one.param; });

TEST_P(ModbusFrame, HalfOpen) {
  lose_and_find({.silent = true});
}
TEST_P(ModbusFrame, Garbage) {
  lose_and_find({.garbage = true});
}
TEST_P(ModbusFrame, HalfAnAnswer) {
  lose_and_find({.truncated = true});
}
TEST_P(ModbusFrame, WrongCrcOrTransaction) {
  lose_and_find({.wrong_check = true});
}
TEST_P(ModbusFrame, SlowerThanItMayBe) {
  lose_and_find({.delay_ms = 150});
}
TEST_P(ModbusFrame, EveryRequestRefused) {
  lose_and_find({.exception = 4});
}

TEST_P(ModbusFrame, AnExceptionIsReportedByNameAndPlace) {
  DrivenRig rig(over());
  rig.drive.set_faults({.exception = 2});
  const auto error = error_of(rig.table->engage());
  EXPECT_EQ(error.what, "the drive refused: illegal data address");
  EXPECT_EQ(error.value, "exception 2");
  EXPECT_NE(error.where.find("0x006A"), std::string::npos) << error.where;  // the first it is set up with
  EXPECT_EQ(rig.table->status().state, TurntableState::kIdle);
}

// A drive that answers "busy" (exception 6) or "still at work" (5) is there, and is asked again.

/// A drive by the exception it answers with, one over each link.
class BusyDrive : public testing::TestWithParam<int> {
 protected:
  static void long_suffering(modbus::ModbusConfig&, turntable::TurntableSettings& settings) {
    settings.stale_after_s = 0.2;
    settings.busy_timeout_s = 10.0;
  }
  const int exception = GetParam();
  DrivenRig rig{exception == 5 ? Over::kTcp : Over::kRtu, EmulatedDrive::Make::kPlain, long_suffering};

  /// Waits until it has refused so many more requests.
  void await_refusals(double count) const {
    const double before = rig.figure("exceptions");
    rig.await([&](const hal::TurntableStatus&) { return rig.figure("exceptions") >= before + count; });
  }
};

INSTANTIATE_TEST_SUITE_P(Exceptions, BusyDrive, testing::Values(5, 6));

TEST_P(BusyDrive, KeepsItsLinkAndItsMotion) {
  const auto number = rig.set_off(120.0);
  rig.drive.set_faults({.exception = exception});
  rig.await([](const hal::TurntableStatus& s) { return s.position_age_s > 0.6; });
  EXPECT_EQ(rig.table->status().motion.end, MotionEnd::kUnderWay);
  rig.drive.set_faults({});
  EXPECT_EQ(rig.await_end_of(number).motion.end, MotionEnd::kArrived);
  EXPECT_EQ(rig.figure("connection_attempts"), 1.0);
}

TEST_P(BusyDrive, IsSetUpAndStartedOnceItIsFree) {
  rig.drive.set_faults({.exception_on_write = exception});
  std::thread freeing([this] {
    await_refusals(3.0);
    rig.drive.set_faults({});
  });
  rig.engage();
  freeing.join();
  EXPECT_EQ(rig.figure("connection_attempts"), 1.0);
  ASSERT_EQ(rig.await_end(rig.table->home()).motion.end, MotionEnd::kArrived);
  rig.await_state(TurntableState::kStanding);
  rig.drive.set_faults({.exception_on_write = exception});
  const auto motion = rig.table->move_to(90.0, {});
  // As long as a table that was started would take to count as stalled.
  rig.await([](const hal::TurntableStatus& s) { return s.motion.end == MotionEnd::kUnderWay; });
  await_refusals(50.0);
  EXPECT_EQ(rig.table->status().motion.end, MotionEnd::kUnderWay);
  rig.drive.set_faults({});
  EXPECT_EQ(rig.await_end(motion).motion.end, MotionEnd::kArrived);
}

TEST_P(BusyDrive, GetsAStopUntilItTakesIt) {
  const auto number = rig.set_off(20.0);
  rig.drive.set_faults({.exception_on_write = exception});
  rig.table->stop();
  await_refusals(5.0);
  EXPECT_TRUE(rig.drive.motor().moving());
  EXPECT_FALSE(rig.table->report().findings.empty());
  rig.drive.set_faults({});
  EXPECT_EQ(rig.await_end_of(number).motion.end, MotionEnd::kStopped);
  EXPECT_FALSE(rig.drive.motor().moving());
  EXPECT_LT(rig.drive.motor().angle_deg(), 165.0);
  EXPECT_TRUE(rig.table->report().findings.empty()) << rig.table->report().findings.front();
}

TEST_P(BusyDrive, AStopEndsAStartThatItHasNotTaken) {
  rig.home();
  rig.drive.set_faults({.exception_on_write = exception});
  const auto motion = rig.table->move_to(90.0, {});
  await_refusals(3.0);
  rig.table->stop();
  EXPECT_EQ(rig.await_end(motion).motion.end, MotionEnd::kStopped);
  rig.drive.set_faults({});
  EXPECT_EQ(rig.await_end(rig.table->move_to(-90.0, {})).motion.end, MotionEnd::kArrived);
  EXPECT_EQ(rig.table->status().motion.number, *motion + 1);
}

TEST(ModbusFault, ADriveThatStaysBusyIsRefusedInTheEnd) {
  DrivenRig rig(
      Over::kTcp, EmulatedDrive::Make::kPlain,
      [](modbus::ModbusConfig&, turntable::TurntableSettings& settings) { settings.busy_timeout_s = 0.3; });
  rig.home();
  rig.drive.set_faults({.exception_on_write = 6});
  const hal::TurntableStatus refused = rig.await_end(rig.table->move_to(90.0, {}));
  EXPECT_EQ(refused.motion.end, MotionEnd::kRefused);
  ASSERT_TRUE(refused.motion.problem);
  EXPECT_EQ(refused.motion.problem->what, "the drive refused: server device busy");
}

TEST(ModbusTcp, ALateAnswerIsNotTakenForTheNext) {
  DrivenRig rig(Over::kTcp, EmulatedDrive::Make::kPlain,
                [](modbus::ModbusConfig& config, turntable::TurntableSettings& settings) {
                  config.link.response_timeout_s = 0.5;
                  settings.stale_after_s = 10.0;
                });
  const auto number = rig.set_off();
  rig.drive.set_faults({.delay_once_ms = 700});
  rig.await([&](const hal::TurntableStatus&) { return rig.figure("late_answers") >= 1.0; });
  EXPECT_EQ(rig.await_end_of(number).motion.end, MotionEnd::kArrived);
  EXPECT_EQ(rig.figure("bad_frames"), 0.0);
  EXPECT_EQ(rig.figure("connection_attempts"), 1.0);
}

TEST(ModbusFault, WhatADriveLacksIsSaid) {
  const auto remedy_of = [](const DriveFaults& faults) {
    DrivenRig rig(Over::kTcp, EmulatedDrive::Make::kPlain,
                  [&faults](modbus::ModbusConfig& config, turntable::TurntableSettings& settings) {
                    settings.engage_timeout_s = 1.0;
                    if (faults.exception != 0) config.map.setup.clear();  // it is read first
                    config.map.start.erase(config.map.start.begin());     // the target is written first
                  });
    if (faults.exception == 0) rig.home();
    rig.drive.set_faults(faults);
    if (faults.exception != 0) return rig.table->engage().value_or(hal::Error{}).remedy;
    return rig.await_end(rig.table->move_to(90.0, {})).motion.problem.value_or(hal::Error{}).remedy;
  };
  const auto expect = [&](const DriveFaults& faults, const char* words) {
    const std::string remedy = remedy_of(faults);
    EXPECT_NE(remedy.find(words), std::string::npos) << remedy;
  };
  expect({.exception = 1}, "function 4");
  expect({.exception = 2}, "max_registers_per_read");
  expect({.exception = 3}, "max_registers_per_read");
  expect({.exception_on_write = 1}, "function 16");
}

// What the drive does, not its frames: over one transport each.

TEST(ModbusFault, ASlowDriveIsStillADrive) {
  DrivenRig rig(Over::kRtu);
  rig.drive.set_faults({.delay_ms = 60});
  rig.home();
  EXPECT_EQ(rig.await_end(rig.table->move_to(90.0, {})).motion.end, MotionEnd::kArrived);
}

TEST(ModbusFault, AnOrderThatIsRefusedEndsTheMotion) {
  DrivenRig rig(Over::kTcp);
  rig.home();
  rig.drive.set_faults({.exception_on_write = 3});
  const hal::TurntableStatus end = rig.await_end(rig.table->move_to(90.0, {}));
  EXPECT_EQ(end.motion.end, MotionEnd::kRefused);
  ASSERT_TRUE(end.motion.problem);
  EXPECT_EQ(end.motion.problem->what, "the drive refused: illegal data value");
  EXPECT_GT(rig.figure("exceptions"), 0.0);
  rig.drive.set_faults({});
  EXPECT_EQ(rig.await_end(rig.table->move_to(90.0, {})).motion.end, MotionEnd::kArrived);
}

TEST(ModbusFault, AStuckTableStallsAndIsClearedByHand) {
  DrivenRig rig(Over::kRtu);
  rig.home();
  rig.drive.hold(true);
  const hal::TurntableStatus end = rig.await_end(rig.table->move_to(90.0, {}));
  EXPECT_EQ(end.motion.end, MotionEnd::kStalled);
  EXPECT_FALSE(rig.drive.motor().moving());
  rig.await_state(TurntableState::kStalled);
  EXPECT_EQ(rig.table->move_to(0.0, {}).error().what, "the table has stalled");
  rig.drive.hold(false);
  ASSERT_FALSE(rig.table->clear_alarm());
  rig.await_state(TurntableState::kStanding);
  EXPECT_EQ(rig.await_end(rig.table->move_to(90.0, {})).motion.end, MotionEnd::kArrived);
}

TEST(ModbusFault, AnAlarmIsReportedWithItsTextAndReset) {
  DrivenRig rig(Over::kTcp);
  const auto number = rig.set_off();
  rig.drive.raise_alarm(0x30);
  EXPECT_EQ(rig.await_end_of(number).motion.end, MotionEnd::kAlarm);
  const hal::TurntableStatus ill = rig.await_state(TurntableState::kAlarm);
  EXPECT_EQ(ill.alarm_code, 0x30U);
  EXPECT_EQ(ill.alarm_text, "overload");
  EXPECT_EQ(rig.table->report().state, hal::PartState::kFaulty);
  EXPECT_EQ(rig.table->home().error().what, "the drive reports an alarm");
  ASSERT_FALSE(rig.table->clear_alarm());
  rig.await_state(TurntableState::kStanding);
  EXPECT_EQ(rig.await_end(rig.table->move_to(0.0, {})).motion.end, MotionEnd::kArrived);
}

TEST(ModbusFault, AWrongWordOrderIsReportedWithTheRightOne) {
  DrivenRig rig(Over::kRtu);
  rig.home();
  ASSERT_EQ(rig.await_end(rig.table->move_to(45.0, {})).motion.end, MotionEnd::kArrived);
  rig.table->disengage();
  rig.drive.set_faults({.wrong_word_order = true});
  const auto error = error_of(rig.table->engage());
  EXPECT_EQ(error.what, "the drive's position is implausible");
  EXPECT_NE(error.remedy.find("word_order = \"little\""), std::string::npos) << error.remedy;
  EXPECT_NE(error.remedy.find("45 deg"), std::string::npos) << error.remedy;
}

TEST(ModbusFault, ANanIsNoPosition) {
  DrivenRig rig(Over::kTcp, EmulatedDrive::Make::kPlain,
                [](modbus::ModbusConfig& config, turntable::TurntableSettings& settings) {
                  impatient(config, settings);
                  modbus::Register& position = config.map.registers[config.map.position_actual];
                  position.address = 6;  // where the drive shows it as a float
                  position.format.type = modbus::NumberType::kF32;
                  position.scale = 1.0;
                });
  const auto number = rig.set_off();
  rig.drive.set_faults({.nan = true});
  EXPECT_EQ(rig.await_end_of(number).motion.end, MotionEnd::kLost);
  EXPECT_GT(rig.figure("implausible_positions"), 0.0);
  rig.drive.set_faults({});
  rig.await_state(TurntableState::kStanding);
}

TEST(ModbusFault, AJumpIsNotBelieved) {
  DrivenRig rig(Over::kRtu, EmulatedDrive::Make::kPlain, impatient);
  rig.home();
  rig.drive.turn_by_hand(170.0);
  rig.await([&](const hal::TurntableStatus&) { return rig.figure("implausible_positions") >= 1.0; });
  // It stays there: it is read again and believed.
  rig.await([](const hal::TurntableStatus& s) {
    return s.state == TurntableState::kStanding && s.position_deg.value_or(0.0) > 169.0;
  });
}

TEST(ModbusRestart, HomingIsLostWithTheDrivesPower) {
  DrivenRig rig(Over::kTcp, EmulatedDrive::Make::kPlain, impatient);
  const auto number = rig.set_off();
  rig.drive.restart();
  const hal::TurntableStatus end = rig.await_end_of(number);
  EXPECT_EQ(end.motion.end, MotionEnd::kLost);
  rig.await_state(TurntableState::kNotHomed);
  EXPECT_EQ(rig.table->move_to(0.0, {}).error().what,
            "the table is not homed: the drive does not know where it is");
  EXPECT_EQ(rig.await_end(rig.table->home()).motion.end, MotionEnd::kArrived);
  EXPECT_EQ(rig.await_end(rig.table->move_to(90.0, {})).motion.end, MotionEnd::kArrived);
}

TEST(ModbusTcp, AClosedConnectionIsOpenedAgain) {
  DrivenRig rig(Over::kTcp, EmulatedDrive::Make::kPlain, impatient);
  rig.home();
  rig.drive.set_faults({.hang_up = true});
  rig.await_state(TurntableState::kLost);
  rig.drive.set_faults({.refuse_connections = true});
  const double attempts = rig.figure("connection_attempts");
  rig.await([&](const hal::TurntableStatus&) { return rig.figure("connection_attempts") > attempts + 1.0; });
  rig.drive.set_faults({});
  rig.await_state(TurntableState::kStanding);
  EXPECT_GT(rig.figure("broken_connections"), 0.0);
  EXPECT_GT(rig.figure("connection_attempts"), 1.0);
}

TEST(ModbusTcp, NothingThereIsReportedAtOnceAndLeavesNothingOpen) {
  int port = 0;
  {
    const EmulatedDrive gone({EmulatedDrive::Make::kPlain, 1, 0, false});
    port = gone.port();
  }
  DrivenRig rig(Over::kTcp, EmulatedDrive::Make::kPlain,
                [port](modbus::ModbusConfig& config, turntable::TurntableSettings& settings) {
                  impatient(config, settings);
                  config.link.port = port;
                });
  EXPECT_EQ(error_of(rig.table->engage()).what, "cannot connect to the drive");
  EXPECT_EQ(rig.table->status().state, TurntableState::kIdle);
  EXPECT_EQ(rig.table->report().state, hal::PartState::kIdle);
}

TEST(ModbusRtu, APortThatIsNotThereIsReported) {
  DrivenRig rig(Over::kRtu, EmulatedDrive::Make::kPlain,
                [](modbus::ModbusConfig& config, turntable::TurntableSettings& settings) {
                  impatient(config, settings);
                  config.link.device = "/dev/no_such_port";
                });
  const auto error = error_of(rig.table->engage());
  EXPECT_EQ(error.what, "cannot connect to the drive");
  EXPECT_NE(error.where.find("/dev/no_such_port"), std::string::npos);
}

TEST(ModbusRtu, AnotherUnitsAnswersAreNotTaken) {
  DrivenRig rig(Over::kRtu, EmulatedDrive::Make::kPlain, impatient);
  rig.engage();
  rig.drive.set_faults({.wrong_unit = true});
  rig.await_state(TurntableState::kLost);
  EXPECT_GT(rig.figure("bad_frames"), 0.0);
  rig.drive.set_faults({});
  rig.await_state(TurntableState::kNotHomed);
}

TEST(ModbusUnbidden, AMotionThatNoOneAskedForIsStopped) {
  DrivenRig rig(Over::kTcp, EmulatedDrive::Make::kPlain, impatient);
  rig.set_off(30.0);
  // The connection breaks and the drive goes on by itself; found again, it is stopped.
  rig.drive.set_faults({.silent = true});
  rig.await_state(TurntableState::kLost);
  EXPECT_TRUE(rig.drive.motor().moving());
  rig.drive.set_faults({});
  rig.await_state(TurntableState::kStanding);
  EXPECT_FALSE(rig.drive.motor().moving());
  EXPECT_LT(rig.drive.motor().angle_deg(), 165.0);
}

}  // namespace
}  // namespace hapticd::test
