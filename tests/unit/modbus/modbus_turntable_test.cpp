#include <gtest/gtest.h>

#include <atomic>
#include <cmath>

#include "tests/support/eventually.h"
#include "tests/support/value_of.h"
#include "tests/unit/modbus/driven_rig.h"

namespace hapticd::test {
namespace {

using hal::MotionEnd;
using hal::TurntableState;

struct Case {
  DrivenRig::Over over;
  EmulatedDrive::Make make;
  const char* name;
  friend void PrintTo(const Case& driven, std::ostream* out) { *out << driven.name; }
};
constexpr Case kPlainTcp{DrivenRig::Over::kTcp, EmulatedDrive::Make::kPlain, "PlainTcp"};
constexpr Case kPlainRtu{DrivenRig::Over::kRtu, EmulatedDrive::Make::kPlain, "PlainRtu"};
constexpr Case kAzTcp{DrivenRig::Over::kTcp, EmulatedDrive::Make::kOrientalAz, "AzTcp"};
constexpr Case kAzRtu{DrivenRig::Over::kRtu, EmulatedDrive::Make::kOrientalAz, "AzRtu"};

class ModbusTurntable : public testing::TestWithParam<Case> {
 protected:
  DrivenRig rig{GetParam().over, GetParam().make};
};

// Each make and each transport once. Makes differ in their registers, transports in their frames: whether
// they go together is seen by the stations, which all four pairs visit.
INSTANTIATE_TEST_SUITE_P(Drives, ModbusTurntable, testing::Values(kPlainTcp, kAzRtu),
                         testing::PrintToStringParamName());

class ModbusStations : public ModbusTurntable {};
INSTANTIATE_TEST_SUITE_P(Drives, ModbusStations, testing::Values(kPlainTcp, kPlainRtu, kAzTcp, kAzRtu),
                         testing::PrintToStringParamName());

TEST_P(ModbusTurntable, OpensNothingBeforeItIsEngagedAndLetsGoAfterwards) {
  EXPECT_EQ(rig.table->status().state, TurntableState::kIdle);
  EXPECT_EQ(rig.table->report().state, hal::PartState::kIdle);
  EXPECT_FALSE(rig.table->home());
  std::this_thread::sleep_for(std::chrono::milliseconds(50));
  EXPECT_EQ(rig.drive.requests(), 0U);
  rig.engage();
  EXPECT_EQ(rig.table->status().state, TurntableState::kNotHomed);
  EXPECT_GT(rig.drive.requests(), 0U);
  rig.table->disengage();
  EXPECT_EQ(rig.table->status().state, TurntableState::kIdle);
  EXPECT_TRUE(eventually([&] { return rig.drive.connections() == 0; }));
}

TEST_P(ModbusStations, AreReachedOnceItIsHomed) {
  rig.engage();
  EXPECT_EQ(error_of(rig.table->move_to(90.0, {})).what,
            "the table is not homed: the drive does not know where it is");
  rig.home();
  EXPECT_NEAR(rig.drive.motor().angle_deg(), 0.0, 0.25);
  EXPECT_EQ(rig.table->status().station, "sponge");
  for (const hal::TurntableStation& station : rig.table->info().stations) {
    const hal::TurntableStatus end = rig.await_end(rig.table->move_to(station.angle_deg, {}));
    EXPECT_EQ(end.motion.end, MotionEnd::kArrived) << (end.motion.problem ? end.motion.problem->text() : "");
    EXPECT_EQ(end.motion.completion, 1.0);
    EXPECT_NEAR(rig.drive.motor().angle_deg(), station.angle_deg, 0.1);
    EXPECT_EQ(rig.await_state(TurntableState::kStanding).station, station.name);
  }
}

TEST_P(ModbusTurntable, KeepsToTheLimitsOfTheMotion) {
  rig.home();
  const auto motion = rig.table->move_to(30.0, {45.0, 90.0});
  double fastest = 0.0;
  const hal::TurntableStatus end = rig.await([&](const hal::TurntableStatus& s) {
    fastest = std::max(fastest, std::abs(rig.drive.motor().velocity_deg_per_s()));
    return motion && s.motion.number == *motion && s.motion.end != MotionEnd::kUnderWay;
  });
  EXPECT_EQ(end.motion.end, MotionEnd::kArrived);
  EXPECT_LE(fastest, 45.1);
  EXPECT_GT(fastest, 30.0);
  EXPECT_NEAR(end.motion.expected_s, 30.0 / 45.0 + 45.0 / 90.0, 1e-9);
}

TEST_P(ModbusTurntable, RefusesWhatCannotBe) {
  rig.home();
  EXPECT_EQ(rig.table->move_to(180.5, {}).error().what, "the angle is out of the table's range");
  EXPECT_EQ(rig.table->move_to(std::nan(""), {}).error().what, "the angle is not finite");
  EXPECT_EQ(rig.table->move_to(0.0, {400.0, 0.0}).error().where, "speed_deg_per_s");
  EXPECT_EQ(rig.table->move_to(0.0, {0.0, -1.0}).error().where, "acceleration_deg_per_s2");
  EXPECT_EQ(rig.drive.motor().moving(), false);
}

TEST_P(ModbusTurntable, StopsOnTheWay) {
  const auto number = rig.set_off();
  const auto another = rig.table->move_to(0.0, {});
  ASSERT_FALSE(another);
  EXPECT_EQ(another.error().what, "another motion is under way");
  rig.table->stop();
  const hal::TurntableStatus end = rig.await_end_of(number);
  EXPECT_EQ(end.motion.end, MotionEnd::kStopped);
  EXPECT_FALSE(rig.drive.motor().moving());
  EXPECT_LT(rig.drive.motor().angle_deg(), 169.0);
  EXPECT_EQ(rig.await_state(TurntableState::kStanding).station, "");
}

TEST_P(ModbusTurntable, DisengagingOnTheWayStopsTheTable) {
  rig.set_off();
  rig.table->disengage();
  EXPECT_TRUE(eventually([&] { return !rig.drive.motor().moving(); }));
  EXPECT_LT(rig.drive.motor().angle_deg(), 169.0);
}

TEST_P(ModbusTurntable, AsksThePermitBeforeAndOnTheWay) {
  std::atomic<bool> forbidden{true};
  rig.table->set_permit([&forbidden]() -> std::optional<hal::Error> {
    if (!forbidden) return std::nullopt;
    return hal::Error{"the tool is in contact", "interlock", "", "", "lift it"};
  });
  rig.engage();
  EXPECT_EQ(error_of(rig.table->home()).what, "the tool is in contact");
  EXPECT_FALSE(rig.drive.motor().moving());
  forbidden = false;
  const auto number = rig.set_off();
  forbidden = true;
  const hal::TurntableStatus end = rig.await_end_of(number);
  EXPECT_EQ(end.motion.end, MotionEnd::kForbidden);
  ASSERT_TRUE(end.motion.problem);
  EXPECT_EQ(end.motion.problem->what, "the tool is in contact");
  EXPECT_FALSE(rig.drive.motor().moving());
  EXPECT_LT(rig.drive.motor().angle_deg(), 169.0);
}

TEST_P(ModbusTurntable, CanBeEngagedAgain) {
  rig.home();
  rig.table->disengage();
  rig.engage();
  EXPECT_EQ(rig.await_state(TurntableState::kStanding).station, "sponge");
  EXPECT_EQ(rig.await_end(rig.table->move_to(90.0, {})).motion.end, MotionEnd::kArrived);
}

}  // namespace
}  // namespace hapticd::test
