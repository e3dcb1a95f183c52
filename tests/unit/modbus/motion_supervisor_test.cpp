#include "hal/turntable/motion_supervisor.h"

#include <gtest/gtest.h>

#include <cmath>

#include "hal/turntable/trapezoid.h"

namespace hapticd::turntable {
namespace {

using Action = MotionSupervisor::Action;
using hal::MotionEnd;

constexpr double kPeriod = 0.02;
constexpr hal::MotionLimits kLimits{90.0, 180.0};

DriveReading at(double position_deg, bool moving, bool in_position) {
  DriveReading reading;
  reading.position_deg = position_deg;
  reading.homed = true;
  reading.moving = moving;
  reading.in_position = in_position;
  reading.alarm = false;
  return reading;
}

class Supervised : public testing::Test {
 protected:
  /// Readings at the poll's pace, position by time; until the motion is over or `for_s` have passed. True
  /// when a stop was to be sent.
  template <class Reading>
  bool run(double for_s, Reading reading) {
    bool stop = false;
    for (const double until = now + for_s; now < until && supervisor.under_way(); now += kPeriod) {
      stop = supervisor.observe(now, reading(now)) == Action::kSendStop || stop;
    }
    return stop;
  }
  /// Readings of a table that turns there from 0 with 60 deg/s, beginning now.
  auto turning_to(double end_deg) const {
    return [end_deg, began = now](double t) {
      const double position = std::min(end_deg, 60.0 * (t - began));
      return at(position, position < end_deg, position >= end_deg);
    };
  }
  MotionEnd end() const { return supervisor.report().end; }

  SupervisionSettings settings;
  MotionSupervisor supervisor{settings};
  double now = 100.0;
};

TEST(Trapezoid, HasItsClosedForm) {
  EXPECT_DOUBLE_EQ(trapezoid_duration_s(90.0, 90.0, 180.0), 1.5);         // 0.5 s up, 0.5 s down, 0.5 s on
  EXPECT_DOUBLE_EQ(trapezoid_duration_s(-20.0, 90.0, 180.0), 2.0 / 3.0);  // a triangle
  EXPECT_DOUBLE_EQ(trapezoid_duration_s(45.0, 90.0, 180.0), 1.0);         // just the one and the other
  EXPECT_EQ(trapezoid_duration_s(0.0, 90.0, 180.0), 0.0);
}

TEST_F(Supervised, ArrivesWhenTheDriveSaysSoAndItsPositionToo) {
  supervisor.begin_move(now, 0.0, 90.0, kLimits);
  const bool stop = run(5.0, turning_to(90.0));
  EXPECT_FALSE(stop);
  EXPECT_EQ(end(), MotionEnd::kArrived);
  EXPECT_EQ(supervisor.report().completion, 1.0);
  EXPECT_NEAR(supervisor.report().elapsed_s, 1.5 + settings.settle_s, 3.0 * kPeriod);
  EXPECT_FALSE(supervisor.report().problem);
}

TEST_F(Supervised, TheLastMotionsFlagIsNotTakenForThisOnes) {
  supervisor.begin_move(now, 0.0, 90.0, kLimits);
  // "In position" stands for a while after the order.
  run(0.3, [](double) { return at(0.0, false, true); });
  EXPECT_EQ(end(), MotionEnd::kUnderWay);
  run(5.0, turning_to(90.0));
  EXPECT_EQ(end(), MotionEnd::kArrived);
}

TEST_F(Supervised, PassingTheTargetIsNotArriving) {
  supervisor.begin_move(now, 0.0, 10.0, kLimits);
  const double began = now;
  run(1.0, [&](double t) { return at(20.0 * (t - began), true, false); });
  EXPECT_EQ(end(), MotionEnd::kUnderWay);
}

TEST_F(Supervised, StallsWithoutProgress) {
  supervisor.begin_move(now, 0.0, 90.0, kLimits);
  EXPECT_TRUE(run(1.0, [](double) { return at(0.0, true, false); }));
  EXPECT_EQ(end(), MotionEnd::kUnderWay);  // it is over once the table is at rest
  EXPECT_TRUE(supervisor.stopping());
  run(5.0, [](double) { return at(0.0, false, false); });
  EXPECT_EQ(end(), MotionEnd::kStalled);
  ASSERT_TRUE(supervisor.report().problem);
  EXPECT_EQ(supervisor.report().problem->what, "the table does not move although it was asked to");
}

TEST_F(Supervised, ASlowMotionIsNoStall) {
  supervisor.begin_move(now, 0.0, 1.0, {0.05, 0.1});
  const double began = now;
  EXPECT_FALSE(run(15.0, [&](double t) {
    const double counted = std::floor(0.05 * (t - began) / 0.04) * 0.04;  // a coarse counter
    return at(counted, true, false);
  }));
  EXPECT_EQ(end(), MotionEnd::kUnderWay);
}

TEST_F(Supervised, MissesWhenTheDriveSaysItArrivedElsewhere) {
  supervisor.begin_move(now, 0.0, 90.0, kLimits);
  run(10.0, turning_to(80.0));
  EXPECT_EQ(end(), MotionEnd::kMissed);
}

TEST_F(Supervised, TimesOutAfterTheTrapezoidAndItsMargin) {
  supervisor.begin_move(now, 0.0, 90.0, kLimits);
  const double began = now;
  double stopped_at = 0.0;
  for (; now < began + 60.0 && stopped_at == 0.0; now += kPeriod) {
    // It creeps, so that it has not stalled.
    if (supervisor.observe(now, at(2.0 * (now - began), true, false)) == Action::kSendStop) stopped_at = now;
  }
  EXPECT_NEAR(stopped_at - began, 1.5 * 1.5 + settings.arrival_margin_s, 2.0 * kPeriod);
  run(5.0, [](double) { return at(9.0, false, false); });
  EXPECT_EQ(end(), MotionEnd::kTimedOut);
}

TEST_F(Supervised, AnAlarmEndsIt) {
  supervisor.begin_move(now, 0.0, 90.0, kLimits);
  run(0.5, [](double) {
    DriveReading reading = at(5.0, false, false);
    reading.alarm = true;
    reading.alarm_code = 48;
    return reading;
  });
  EXPECT_EQ(end(), MotionEnd::kAlarm);
  EXPECT_EQ(supervisor.report().problem->value, "code 48");
}

TEST_F(Supervised, ADriveThatLosesItsHomingOnTheWayIsLost) {
  supervisor.begin_move(now, 0.0, 90.0, kLimits);
  run(1.0, [](double) {
    DriveReading reading = at(5.0, false, true);
    reading.homed = false;
    return reading;
  });
  EXPECT_EQ(end(), MotionEnd::kLost);
}

TEST_F(Supervised, AStopIsOverWhenTheTableStands) {
  supervisor.begin_move(now, 0.0, 90.0, kLimits);
  run(0.5, [](double t) { return at(30.0 * (t - 100.0), true, false); });
  EXPECT_EQ(supervisor.stop(now, MotionEnd::kForbidden, hal::Error{"contact", "", "", "", ""}),
            Action::kSendStop);
  EXPECT_EQ(supervisor.stop(now, MotionEnd::kStopped, std::nullopt),
            Action::kNone);  // it is stopping already
  run(0.3, [](double t) { return at(30.0 * (t - 100.0), true, false); });
  EXPECT_EQ(end(), MotionEnd::kUnderWay);
  run(1.0, [](double) { return at(24.0, false, false); });
  EXPECT_EQ(end(), MotionEnd::kForbidden);
  EXPECT_EQ(supervisor.report().problem->what, "contact");
}

TEST_F(Supervised, ATableThatDoesNotStopIsReported) {
  supervisor.begin_move(now, 0.0, 90.0, kLimits);
  supervisor.stop(now, MotionEnd::kStopped, std::nullopt);
  run(10.0, [](double t) { return at(30.0 * (t - 100.0), true, false); });
  EXPECT_EQ(end(), MotionEnd::kStopped);
  EXPECT_EQ(supervisor.report().problem->what, "the table was asked to stop but still moves");
}

TEST_F(Supervised, AStopThatTheDriveDoesNotTakeIsReported) {
  supervisor.begin_move(now, 0.0, 90.0, kLimits);
  supervisor.stop(now, MotionEnd::kStopped, std::nullopt);
  supervisor.stop_answered(now, hal::Error{"the drive refused: busy", "", "", "", ""});
  const auto turning = [](double t) { return at(30.0 * (t - 100.0), true, false); };
  run(2.5, turning);
  supervisor.stop_answered(now, std::nullopt);  // from here on it has its time to come to rest
  run(2.5, turning);
  EXPECT_EQ(end(), MotionEnd::kUnderWay);
  supervisor.stop_answered(now, hal::Error{"the drive refused: busy", "", "", "", ""});
  run(1.0, turning);
  EXPECT_EQ(end(), MotionEnd::kStopped);
  EXPECT_EQ(supervisor.report().problem->what, "the table still moves: the drive has not taken the stop");
}

TEST_F(Supervised, AnOrderThatIsNotTakenYetIsNoStall) {
  supervisor.begin_move(now, 0.0, 90.0, kLimits);
  for (int i = 0; i < 300; ++i, now += kPeriod) {
    supervisor.postpone(now);
    EXPECT_EQ(supervisor.observe(now, at(0.0, false, true)), Action::kNone);
  }
  EXPECT_EQ(end(), MotionEnd::kUnderWay);
  EXPECT_TRUE(run(2.0, [](double) { return at(0.0, true, false); }));
}

TEST_F(Supervised, HomesOnceTheFlagIsSetAgainAndTheTableStands) {
  supervisor.begin_home(now, 40.0);
  const double began = now;
  run(5.0, [&](double t) {
    DriveReading reading = at(40.0 - 40.0 * std::min(t - began, 1.0), t - began < 1.0, false);
    reading.homed = t - began > 1.0;
    return reading;
  });
  EXPECT_EQ(end(), MotionEnd::kArrived);
  EXPECT_GT(supervisor.report().elapsed_s, 1.0);
}

TEST_F(Supervised, ADriveThatIsHomedAlreadyIsGivenTimeToBegin) {
  supervisor.begin_home(now, 0.0);
  run(0.5, [](double) { return at(0.0, false, true); });
  EXPECT_EQ(end(), MotionEnd::kUnderWay);
  run(1.0, [](double) { return at(0.0, false, true); });
  EXPECT_EQ(end(), MotionEnd::kArrived);
}

TEST_F(Supervised, HomingThatFindsNoSwitchTimesOut) {
  settings.homing_timeout_s = 5.0;
  supervisor = MotionSupervisor(settings);
  supervisor.begin_home(now, 0.0);
  EXPECT_TRUE(run(6.0, [](double t) {
    DriveReading reading = at(-10.0 * (t - 100.0), true, false);
    reading.homed = false;
    return reading;
  }));
  run(1.0, [](double) { return at(-50.0, false, false); });
  EXPECT_EQ(end(), MotionEnd::kTimedOut);
}

TEST_F(Supervised, ADriveWithoutFlagsIsJudgedByItsPosition) {
  supervisor.begin_move(now, 0.0, 90.0, kLimits);
  const double began = now;
  run(5.0, [&](double t) {
    DriveReading reading;
    reading.position_deg = std::min(90.05, 60.0 * (t - began));
    return reading;
  });
  EXPECT_EQ(end(), MotionEnd::kArrived);
}

}  // namespace
}  // namespace hapticd::turntable
