// The device on a board that works: homing, position, force, limits, information, cost.

#include <gtest/gtest.h>

#include <cmath>
#include <thread>

#include "../allocation_counter.h"
#include "device_bench.h"
#include "hal/daq/daq_sensor.h"
#include "tests/support/temporary_folder.h"
#include "tests/support/value_of.h"

namespace hapticd::phantom {
namespace {

using test::DeviceBench;
namespace status = hal::sample_status;

TEST(PhantomDevice, IsNotReadyAndForcelessUntilHomed) {
  DeviceBench bench;
  EXPECT_EQ(bench.read().status, status::kDeviceNotReady) << "not engaged";
  EXPECT_TRUE(bench.device->home()) << "cannot be homed then either";
  ASSERT_FALSE(bench.device->engage());
  for (int k = 0; k < 300; ++k) {
    EXPECT_EQ(bench.tick({1.0, 1.0, 1.0}).status, status::kDeviceNotReady);
    EXPECT_TRUE(bench.at_zero_volts());
  }
  EXPECT_EQ(bench.device->report().state, hal::PartState::kConnecting);
  EXPECT_TRUE(bench.finds("home it"));
  EXPECT_EQ(bench.figure("withheld_commands"), 300.0);

  ASSERT_FALSE(bench.device->home());
  for (int k = 0; k < 150; ++k) bench.tick();
  EXPECT_TRUE(bench.device->homed());
  const hal::RigSample sample = bench.tick({0.0, 0.0, 1.0});
  EXPECT_EQ(sample.status, 0U);
  EXPECT_FALSE(bench.at_zero_volts());
  EXPECT_EQ(bench.device->report().state, hal::PartState::kReady);
  EXPECT_DOUBLE_EQ(sample.tip_position_mm.x, 215.0);
  EXPECT_DOUBLE_EQ(sample.tip_position_mm.z, -170.0);
}

TEST(PhantomDevice, IsHomedOnlyWhenTheArmRests) {
  DeviceBench bench;
  ASSERT_FALSE(bench.device->engage());
  bench.tick();
  ASSERT_FALSE(bench.device->home());
  for (int k = 0; k < 400; ++k) {
    bench.board->move_joints({0.002 * (k % 50), 0.0, 0.0});
    bench.tick();
  }
  EXPECT_FALSE(bench.device->homed()) << "someone is moving it";
  EXPECT_TRUE(bench.finds("keep the arm still"));
  bench.board->move_joints({0.0, 0.0, 0.0});
  for (int k = 0; k < 150; ++k) bench.tick();
  EXPECT_TRUE(bench.device->homed());
}

TEST(PhantomDevice, MayBeHomedByItself) {
  DeviceBench bench({.home_on_engage = true});
  ASSERT_FALSE(bench.device->engage());
  for (int k = 0; k < 150; ++k) bench.tick();
  EXPECT_TRUE(bench.device->homed());
}

TEST(PhantomDevice, TellsWhereTheTipIsToItsResolution) {
  for (const int bits : {16, 24, 32}) {
    PhantomConfig config{.origin_mm = {-180.0, 20.0, 300.0}};
    emulators::ScriptedBoardConfig board{.counter_bits = bits};
    board.arm.shoulder_mm = config.origin_mm;
    DeviceBench bench(config, board);
    bench.make_ready();
    for (const hal::Vector3& target : {hal::Vector3{60.0, 40.0, 150.0}, hal::Vector3{0.0, -60.0, 200.0},
                                       hal::Vector3{90.0, 0.0, 90.0}, hal::Vector3{35.0, 20.0, 130.0}}) {
      const hal::Vector3 off = bench.go_to(target).tip_position_mm - target;
      EXPECT_LT(std::sqrt(dot(off, off)), 0.03) << bits << " bits";
    }
  }
}

TEST(PhantomDevice, SignsOfEncodersAndMotorsAreConfiguration) {
  DeviceBench bench({.encoder_sign = {-1.0, 1.0, 1.0}, .motor_sign = {-1.0, 1.0, 1.0}});
  bench.make_ready();
  EXPECT_NEAR(bench.turn_to({}, {0.02, 0.0, 0.0}).tip_position_mm.y, -215.0 * std::sin(0.02), 0.03);
  bench.turn_to({0.02, 0.0, 0.0}, {});
  bench.tick({0.0, 1.0, 0.0});
  EXPECT_NEAR(bench.board->tip_force_n().y, -1.0, 0.01);
}

TEST(PhantomDevice, TheMotorsMakeTheForceThatIsAskedFor) {
  DeviceBench bench;
  bench.make_ready();
  for (const hal::Vector3& place : {hal::Vector3{215.0, 0.0, -170.0}, hal::Vector3{230.0, 60.0, -100.0},
                                    hal::Vector3{160.0, -80.0, -190.0}}) {
    bench.go_to(place);
    for (const hal::Vector3& force :
         {hal::Vector3{1.0, 0.0, 0.0}, hal::Vector3{0.0, -2.0, 0.5}, hal::Vector3{-1.0, 1.5, -3.0}}) {
      bench.tick(force);
      const hal::Vector3 off = bench.board->tip_force_n() - force;
      // A step of the 16-bit output is 0.3 mV, 0.4 mN; the counts put the tip a little aside.
      EXPECT_LT(std::sqrt(dot(off, off)), 0.003);
    }
  }
  EXPECT_EQ(bench.figure("scaled_commands"), 0.0);
}

TEST(PhantomDevice, MoreThanTheMotorsGiveIsScaledAndSaid) {
  DeviceBench bench;
  bench.make_ready();
  bench.tick({0.0, 3.0, 30.0});
  const hal::Vector3 made = bench.board->tip_force_n();
  EXPECT_NEAR(made.y / made.z, 0.1, 1e-3) << "the direction is kept";
  EXPECT_NEAR(made.z, 5.51 * 23.4 * 11.2 / 215.0, 0.01) << "joint 2 at its peak current";
  EXPECT_EQ(bench.tick().status, status::kDeviceOverForce);
  EXPECT_EQ(bench.tick().status, 0U);
  EXPECT_EQ(bench.figure("scaled_commands"), 1.0);
}

TEST(PhantomDevice, SaysWhatItGivesInItsPoseAndGivesThatInAnyDirection) {
  DeviceBench bench;
  EXPECT_EQ(bench.read().max_force_n, 0.0) << "the pose is not known";
  bench.make_ready();
  EXPECT_NEAR(bench.read().max_force_n, bench.device->info().max_force_n, 1e-6) << "in the reset pose";
  std::array<double, 3> pose{};
  double min_n = 100.0;
  for (const std::array<double, 3>& to :
       {std::array{0.3, 0.5, 0.4}, std::array{-0.4, 0.0, 0.9}, std::array{0.0, -0.2, 0.2}}) {
    bench.turn_to(pose, to);
    pose = to;
    const double given_n = bench.tick().max_force_n;
    min_n = std::min(min_n, given_n);
    ASSERT_GT(given_n, 1.0);
    for (const hal::Vector3& way : {hal::Vector3{1, 0, 0}, hal::Vector3{0, 1, 0}, hal::Vector3{0, 0, 1},
                                    hal::Vector3{-0.6, 0, 0.8}, hal::Vector3{0, -0.8, -0.6}}) {
      bench.tick(way * given_n);
      const hal::Vector3 made = bench.board->tip_force_n();
      EXPECT_NEAR(dot(made, way), given_n, 0.01 * given_n);
      EXPECT_EQ(bench.tick().status & status::kDeviceOverForce, 0U);
    }
  }
  EXPECT_LT(min_n, 0.95 * bench.device->info().max_force_n) << "or this proves little";
}

TEST(PhantomDevice, AWarmMotorIsSaidAndSpared) {
  DeviceBench bench;
  bench.make_ready();
  const hal::Vector3 much{0.0, 0.0, 6.5};
  int warm_at = -1;
  int over_force_at = -1;
  double last_z = 0.0;
  for (int k = 0; k < 60'000; ++k) {
    const hal::RigSample sample = bench.tick(much);
    ASSERT_EQ(sample.status & status::kDeviceFault, 0U);
    if (warm_at < 0 && (sample.status & status::kDeviceWarm) != 0) warm_at = k;
    if (over_force_at < 0 && (sample.status & status::kDeviceOverForce) != 0) over_force_at = k;
    last_z = bench.board->tip_force_n().z;
  }
  EXPECT_GT(warm_at, 300) << "6.5 N, 4.6 times the continuous force, are given for half a second";
  EXPECT_LT(warm_at, 600);
  EXPECT_GE(over_force_at, warm_at);
  EXPECT_NEAR(last_z, 1.4, 0.15) << "what is left is the continuous force";
  EXPECT_TRUE(bench.finds("warm"));
  for (int k = 0; k < 5'000; ++k) bench.tick();
  EXPECT_EQ(bench.tick().status, 0U) << "and it cools";
}

TEST(PhantomDevice, SaysWhatItIs) {
  DeviceBench bench;
  const hal::DeviceInfo& info = bench.device->info();
  EXPECT_EQ(info.model, "phantom_premium_1_5");
  EXPECT_NEAR(info.max_force_n, 6.7, 0.05) << "what it can give any way it is asked, not its best axis";
  EXPECT_DOUBLE_EQ(info.max_continuous_force_n, 1.4);
  EXPECT_NEAR(info.position_resolution_mm, 0.03, 0.001);
  EXPECT_DOUBLE_EQ(info.structural_stiffness_n_per_mm, 3.5);
  EXPECT_DOUBLE_EQ(info.coulomb_friction_n, 0.04);
  EXPECT_FALSE(bench.device->uncertain().empty());
  EXPECT_EQ(bench.device->clock(), nullptr) << "a periodic thread may drive it";
}

TEST(PhantomDevice, AGimbalTurnsTheOrientation) {
  PhantomConfig config;
  config.gimbal = true;
  DeviceBench bench(config);
  bench.make_ready();
  bench.board->turn_gimbal({0.0, 0.0, 0.6});
  const hal::RigSample sample = bench.tick();
  EXPECT_NEAR(sample.tip_orientation.w, std::cos(0.3), 1e-3);
  EXPECT_NEAR(sample.tip_orientation.x, std::sin(0.3), 1e-3);
  EXPECT_TRUE(sample.angles.known);
  EXPECT_NEAR(sample.angles.gimbal_rad[2], 0.6, 2e-3);
  for (std::size_t i = 0; i < 3; ++i) EXPECT_NEAR(sample.angles.joint_rad[i], config.reset_pose_rad[i], 1e-3);
  DeviceBench plain;
  plain.make_ready();
  plain.board->turn_gimbal({0.0, 0.0, 0.6});
  EXPECT_EQ(plain.tick().tip_orientation.w, 1.0) << "without a gimbal there is none to read";
}

TEST(PhantomDevice, HoldsItsPlaceAndTouchesNothingElseOfASample) {
  DeviceBench bench;
  bench.make_ready();
  bench.go_to({200.0, 30.0, -150.0});
  const hal::Vector3 there = bench.read().tip_position_mm;
  bench.device->disengage();
  hal::RigSample sample;
  sample.tick = 7;
  sample.sensor_force_n = {1.0, 2.0, 3.0};
  sample.status = status::kForceWarning;
  bench.device->read(sample);
  EXPECT_EQ(sample.tip_position_mm.x, there.x);
  EXPECT_EQ(sample.tick, 7U);
  EXPECT_EQ(sample.sensor_force_n.y, 2.0);
  EXPECT_EQ(sample.status, status::kForceWarning | status::kDeviceNotReady);
}

TEST(PhantomDevice, SharesItsBoardAndOpensOnlyItsHalf) {
  DeviceBench bench;
  bench.make_ready();
  EXPECT_FALSE(bench.board->engaged(daq::BoardUse::kInputs));
  EXPECT_FALSE(bench.device->engage()) << "once more changes nothing";
  EXPECT_TRUE(bench.device->homed());
  bench.device->disengage();
  EXPECT_FALSE(bench.board->engaged(daq::BoardUse::kMotion));
  ASSERT_FALSE(bench.device->engage());
  EXPECT_EQ(bench.tick().status, status::kDeviceNotReady) << "who knows where the arm went";
}

TEST(PhantomDevice, ASensorMayLiveOnTheSameBoard) {
  DeviceBench bench;
  bench.make_ready();
  const test::TemporaryFolder folder;
  daq::DaqSensorConfig config{
      .calibration_file = folder.write("sensor.cal", bench.board->gauges().calibration_file({})),
      .bias_on_engage = false};
  auto sensor = test::value_of(daq::DaqSensor::create(config, bench.board));
  std::thread clock([&] {
    test::eventually([&] { return bench.board->engaged(daq::BoardUse::kInputs); });
    bench.pass_ms(2.0);
  });
  ASSERT_FALSE(sensor->engage());
  clock.join();
  hal::RigSample sample;
  sensor->read(sample);  // what came in between
  sample = bench.tick({0.0, 0.0, 1.0});
  const hal::Vector3 tip = sample.tip_position_mm;
  sensor->read(sample);
  EXPECT_EQ(sample.status, 0U);
  EXPECT_EQ(sample.force_count, 10U);
  EXPECT_EQ(sample.tip_position_mm.x, tip.x);
  sensor->disengage();
  EXPECT_EQ(bench.tick({0.0, 0.0, 1.0}).status, 0U) << "the device does not notice";
  EXPECT_NEAR(bench.board->tip_force_n().z, 1.0, 0.01);
}

TEST(PhantomDevice, WrongBoardsAndValuesAreRefused) {
  PhantomConfig config{.watchdog_ms = -1.0};
  EXPECT_FALSE(PhantomDevice::create(config, std::make_shared<emulators::ScriptedBoard>()));
  EXPECT_FALSE(PhantomDevice::create({}, nullptr));
}

TEST(PhantomDevice, ATickAsksForNoMemory) {
  DeviceBench bench;
  bench.make_ready();
  hal::RigSample sample;
  const long before = test::allocations();
  for (int k = 0; k < 10'000; ++k) {
    bench.pass_ms(1.0);
    bench.device->read(sample);
    bench.device->write({{0.1, 0.2, 0.3}});
  }
  EXPECT_EQ(test::allocations(), before);
  EXPECT_EQ(sample.status, 0U);
}

}  // namespace
}  // namespace hapticd::phantom
