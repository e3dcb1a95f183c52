// Everything that may go wrong between encoders, motors and the one who commands, and what it takes to fix.

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <thread>

#include "device_bench.h"
#include "tests/support/value_of.h"

namespace hapticd::phantom {
namespace {

using test::DeviceBench;
using test::eventually;
namespace status = hal::sample_status;

constexpr hal::Vector3 kPush{0.5, 0.5, 0.5};

class PhantomDeviceFault : public testing::Test {
 protected:
  void SetUp() override {
    bench.make_ready();
    bench.tick(kPush);
    ASSERT_FALSE(bench.at_zero_volts());
  }
  void expect_force_again() {
    bench.tick(kPush);
    EXPECT_EQ(bench.tick(kPush).status, 0U);
    EXPECT_NEAR(bench.board->tip_force_n().z, kPush.z, 0.01);
  }
  DeviceBench bench;
};

TEST_F(PhantomDeviceFault, AnEncoderThatJumpsIsAFaultUntilHomedAgain) {
  const hal::Vector3 before = bench.read().tip_position_mm;
  bench.board->jump_encoder(1, 2500);  // 0.34 rad within a tick
  const hal::RigSample sample = bench.tick(kPush);
  EXPECT_EQ(sample.status, status::kDeviceFault);
  EXPECT_EQ(sample.tip_position_mm.z, before.z) << "the tip is not thrown anywhere";
  EXPECT_TRUE(bench.at_zero_volts()) << "within the tick";
  EXPECT_EQ(bench.device->report().state, hal::PartState::kFaulty);
  EXPECT_TRUE(bench.finds("joint 2 has jumped"));
  bench.board->jump_encoder(1, -2500);
  for (int k = 0; k < 50; ++k) EXPECT_EQ(bench.tick(kPush).status, status::kDeviceFault) << "it stays";
  ASSERT_FALSE(bench.device->home());
  for (int k = 0; k < 150; ++k) bench.tick();
  expect_force_again();
  EXPECT_EQ(bench.figure("encoder_jumps"), 1.0);
}

TEST_F(PhantomDeviceFault, AFrozenEncoderHoldsItsAngleAndNothingBreaks) {
  bench.board->freeze_encoder(0);
  bench.tick();
  const hal::RigSample sample = bench.turn_to({}, {0.05, 0.05, 0.0});
  EXPECT_EQ(sample.status, 0U) << "an arm may rest: this cannot be reported";
  EXPECT_NEAR(sample.tip_position_mm.y, 0.0, 1e-9);
  EXPECT_NEAR(sample.tip_position_mm.z, 215.0 * std::sin(0.05) - 170.0, 0.05);
  // Set free again, it is at a place that no arm can have reached in a tick, if it was held for long.
  bench.board->move_joints({0.5, 0.05, 0.0});
  bench.board->freeze_encoder(0, false);
  EXPECT_EQ(bench.tick(kPush).status, status::kDeviceFault);
  EXPECT_TRUE(bench.at_zero_volts());
}

TEST_F(PhantomDeviceFault, CountersThatCannotBeReadAreAFaultWhileItLasts) {
  const hal::Vector3 before = bench.read().tip_position_mm;
  bench.board->fail_counters();
  const hal::RigSample sample = bench.tick(kPush);
  EXPECT_EQ(sample.status, status::kDeviceFault);
  EXPECT_EQ(sample.tip_position_mm.x, before.x);
  EXPECT_TRUE(bench.at_zero_volts());
  EXPECT_TRUE(bench.finds("counts cannot be read"));
  EXPECT_EQ(bench.device->report().last_fault, "");
  bench.board->fail_counters(false);
  expect_force_again();
  EXPECT_FALSE(bench.finds("counts cannot be read"));
  EXPECT_NE(bench.device->report().last_fault.find(" s ago: the encoders' counts cannot be read"),
            std::string::npos)
      << "whoever asks later still learns what it was";
}

TEST_F(PhantomDeviceFault, OutputsThatFailAreAFaultAtTheNextRead) {
  bench.board->fail_outputs();
  bench.tick(kPush);
  EXPECT_EQ(bench.tick(kPush).status, status::kDeviceFault);
  EXPECT_TRUE(bench.finds("does not accept the motors' volts"));
  EXPECT_GE(bench.figure("output_failures"), 2.0);
  bench.board->fail_outputs(false);
  bench.tick(kPush);
  EXPECT_TRUE(bench.at_zero_volts()) << "the first that is taken is zero";
  expect_force_again();
}

TEST_F(PhantomDeviceFault, ABoardThatIsGoneIsAFaultAndMayComeBack) {
  bench.board->vanish();
  for (int k = 0; k < 20; ++k) EXPECT_EQ(bench.tick(kPush).status, status::kDeviceFault);
  bench.board->vanish(false);
  bench.tick(kPush);
  expect_force_again();
}

TEST_F(PhantomDeviceFault, ABoardThatIsGoneCannotBeEngaged) {
  bench.device->disengage();
  bench.board->vanish();
  EXPECT_TRUE(bench.device->engage());
  EXPECT_EQ(bench.read().status, status::kDeviceNotReady);
  bench.board->vanish(false);
  bench.board->fail_counters();
  EXPECT_NE(test::error_of(bench.device->engage()).what.find("counts"), std::string::npos);
  bench.board->fail_counters(false);
  bench.board->fail_outputs();
  EXPECT_NE(test::error_of(bench.device->engage()).what.find("volts"), std::string::npos);
  EXPECT_FALSE(bench.board->engaged(daq::BoardUse::kMotion)) << "nothing stays open";
}

TEST_F(PhantomDeviceFault, AnArmBeyondItsStopsWasHomedElsewhere) {
  // Turned slowly to a place that no first joint reaches.
  hal::RigSample sample;
  for (int k = 0; k <= 400; ++k) {
    bench.board->move_joints({0.0042 * k, 0.0, 0.0});
    sample = bench.tick(kPush);
  }
  EXPECT_EQ(sample.status, status::kDeviceFault);
  EXPECT_TRUE(bench.at_zero_volts());
  EXPECT_TRUE(bench.finds("beyond its stops"));
  for (int k = 400; k >= 300; --k) {
    bench.board->move_joints({0.0042 * k, 0.0, 0.0});
    sample = bench.tick(kPush);
  }
  EXPECT_EQ(sample.status, 0U) << "it is over when it is over";
}

TEST_F(PhantomDeviceFault, ATipThatIsTooFastGetsNoForce) {
  hal::RigSample sample;
  for (int k = 1; k <= 10; ++k) {
    bench.board->move_joints({0.01 * k, 0.0, 0.0});  // 2.15 m/s
    sample = bench.tick(kPush);
  }
  EXPECT_EQ(sample.status, status::kDeviceOverSpeed);
  EXPECT_TRUE(bench.at_zero_volts());
  EXPECT_TRUE(bench.finds("faster than allowed"));
  for (int k = 0; k < 5; ++k) bench.tick();
  expect_force_again();
}

TEST_F(PhantomDeviceFault, CommandsThatAreNoNumbersAreZero) {
  for (const double bad :
       {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity()}) {
    bench.tick(kPush);
    bench.tick({bad, 1.0, 1.0});
    EXPECT_TRUE(bench.at_zero_volts());
  }
  EXPECT_EQ(bench.figure("unfit_commands"), 2.0);
  expect_force_again();
}

TEST_F(PhantomDeviceFault, ACommandHeldTooLongWhileHotIsAFault) {
  // The loop is away for seconds at full force and, for the sake of this test, the watchdog sleeps too.
  DeviceBench other({.watchdog_ms = 1000.0});
  other.make_ready();
  other.tick({0.0, 0.0, 6.5});
  for (int k = 0; k < 30; ++k) other.pass_ms(100.0);
  other.device->write({});
  const hal::RigSample sample = other.read();
  EXPECT_NE(sample.status & status::kDeviceFault, 0U);
  EXPECT_NE(sample.status & status::kDeviceWarm, 0U);
  EXPECT_TRUE(other.finds("too hot"));
  other.device->write({kPush});
  EXPECT_TRUE(other.at_zero_volts());
  for (int k = 0; k < 40'000; ++k) other.tick();
  EXPECT_EQ(other.tick().status, 0U) << "and it is over when it has cooled";
}

TEST_F(PhantomDeviceFault, WithoutACommandTheWatchdogCuts) {
  bench.pass_ms(19.0);
  std::this_thread::sleep_for(std::chrono::milliseconds(30));
  EXPECT_FALSE(bench.at_zero_volts()) << "not before its time";
  bench.pass_ms(2.0);
  ASSERT_TRUE(eventually([&] { return bench.at_zero_volts(); }));
  ASSERT_TRUE(eventually([&] { return bench.figure("watchdog_cuts") == 1.0; }));
  // A late command that knows of nothing changes nothing; only who was reported may command again.
  bench.device->write({kPush});
  EXPECT_TRUE(bench.at_zero_volts());
  EXPECT_EQ(bench.read().status, status::kCommandStale);
  EXPECT_EQ(bench.read().status, 0U) << "reported once";
  bench.device->write({kPush});
  EXPECT_NEAR(bench.board->tip_force_n().z, kPush.z, 0.01);
}

TEST_F(PhantomDeviceFault, AfterACutTheDogIsQuietUntilTheNextCommand) {
  bench.pass_ms(30.0);
  ASSERT_TRUE(eventually([&] { return bench.figure("watchdog_cuts") == 1.0; }));
  bench.pass_ms(500.0);
  std::this_thread::sleep_for(std::chrono::milliseconds(50));
  EXPECT_EQ(bench.figure("watchdog_cuts"), 1.0);
  bench.tick(kPush);
  bench.pass_ms(30.0);
  ASSERT_TRUE(eventually([&] { return bench.figure("watchdog_cuts") == 2.0; }));
}

TEST_F(PhantomDeviceFault, ADogThatIsNotObeyedGoesOnTrying) {
  bench.board->fail_outputs();
  bench.pass_ms(30.0);
  ASSERT_TRUE(eventually([&] { return bench.figure("watchdog_cuts") >= 2.0; }));
  bench.board->fail_outputs(false);
  EXPECT_TRUE(eventually([&] { return bench.at_zero_volts(); }));
}

TEST_F(PhantomDeviceFault, TickAndDogInEachOthersWay) {
  // Live: a loop that stalls now and then, in real time, while the dog watches and others ask.
  auto board = std::make_shared<emulators::ScriptedBoard>();
  PhantomConfig config{.watchdog_ms = 2.0, .home_still_ms = 1.0};
  auto made = test::value_of(PhantomDevice::create(config, board));
  PhantomDevice& device = *made;
  ASSERT_FALSE(device.engage());
  ASSERT_FALSE(device.home());
  std::atomic<bool> stop{false};
  std::thread asker([&] {
    while (!stop.load()) {
      device.report();
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
  });
  int cuts = 0;
  for (int k = 0; k < 600; ++k) {
    hal::RigSample sample;
    device.read(sample);
    if ((sample.status & status::kCommandStale) != 0) ++cuts;
    device.write({{0.0, 0.0, 0.1}});
    std::this_thread::sleep_for(std::chrono::microseconds(k % 50 == 49 ? 10'000 : 200));
  }
  EXPECT_GT(cuts, 3);
  ASSERT_TRUE(eventually([&] { return board->output_volts() == std::array<double, 3>{}; }))
      << "the loop has ended without a word";
  stop.store(true);
  asker.join();
}

}  // namespace
}  // namespace hapticd::phantom
