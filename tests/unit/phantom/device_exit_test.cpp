// Zero volts whatever way it ends.

#include <gtest/gtest.h>

#include <cstdio>
#include <cstdlib>

#include "device_bench.h"

namespace hapticd::phantom {
namespace {

using test::DeviceBench;

TEST(PhantomDeviceExit, DisengagingLeavesZeroVolts) {
  DeviceBench bench;
  bench.make_ready();
  bench.tick({1.0, 1.0, 1.0});
  ASSERT_FALSE(bench.at_zero_volts());
  bench.device->disengage();
  EXPECT_TRUE(bench.at_zero_volts());
  const auto writes = bench.board->output_writes();
  bench.device->write({{1.0, 1.0, 1.0}});
  EXPECT_EQ(bench.board->output_writes(), writes) << "and nothing is written any more";
}

TEST(PhantomDeviceExit, DestructionLeavesZeroVolts) {
  DeviceBench bench;
  bench.make_ready();
  bench.tick({1.0, 1.0, 1.0});
  bench.device.reset();
  EXPECT_TRUE(bench.at_zero_volts());
  EXPECT_FALSE(bench.board->engaged(daq::BoardUse::kMotion));
}

TEST(PhantomDeviceExit, ACrashLeavesZeroVoltsAndNoTickAfterItWrites) {
  DeviceBench bench;
  bench.make_ready();
  bench.tick({1.0, 1.0, 1.0});
  ASSERT_FALSE(bench.at_zero_volts());
  bench.device->write_zero_in_crash();
  EXPECT_TRUE(bench.at_zero_volts());
  const auto writes = bench.board->output_writes();
  bench.device->write({{1.0, 1.0, 1.0}});  // the loop's thread is still there for a moment
  EXPECT_EQ(bench.board->output_writes(), writes);
  bench.device->disengage();
  bench.device->write_zero_in_crash();
  EXPECT_EQ(bench.board->output_writes(), writes) << "not engaged: nothing is there to write to";
}

TEST(PhantomDeviceExit, EngagingStartsFromZeroVolts) {
  DeviceBench bench;
  ASSERT_FALSE(bench.board->engage(daq::BoardUse::kMotion));  // left by someone else
  ASSERT_TRUE(bench.board->write_volts(std::array{1.0, 2.0, 3.0}));
  ASSERT_FALSE(bench.device->engage());
  EXPECT_TRUE(bench.at_zero_volts());
}

/// A board that says what reaches its outputs, also after main() has ended.
class TellingBoard final : public daq::Board {
 public:
  daq::BoardInfo info() const override { return {.outputs = 3, .counters = 3}; }
  daq::ScanReading take_scans(std::span<daq::Scan>) noexcept override { return {}; }
  void describe(hal::PartReport&) const override {}

 protected:
  std::optional<hal::Error> open(daq::BoardUse) override { return std::nullopt; }
  void close(daq::BoardUse) noexcept override {}
  bool read_raw_counters(std::span<std::uint64_t> raw) noexcept override {
    for (std::uint64_t& count : raw) count = 0;
    return true;
  }
  bool put_volts(std::span<const double> volts) noexcept override {
    bool zero = true;
    for (const double v : volts) zero = zero && v == 0.0;
    std::fputs(zero ? "zero;" : "force;", stderr);
    return true;
  }
};

[[noreturn]] void end_with_force_on(void (*end)(int)) {
  PhantomConfig config{.home_still_ms = 0.0, .home_on_engage = true};
  config.watchdog_ms = 1000.0;  // not this one's doing
  auto made = PhantomDevice::create(config, std::make_shared<TellingBoard>());
  if (!made || (*made)->engage()) std::abort();
  PhantomDevice* const device = made->release();  // no destructor will run
  hal::RigSample sample;
  device->read(sample);
  device->write({{0.0, 0.0, 1.0}});
  end(0);
  std::abort();
}

TEST(PhantomDeviceExitDeathTest, TheProcessEndsWithZeroVolts) {
  GTEST_FLAG_SET(death_test_style, "threadsafe");
  EXPECT_EXIT(end_with_force_on(std::exit), testing::ExitedWithCode(0), "force;(zero;)+$");
  EXPECT_EXIT(end_with_force_on(std::quick_exit), testing::ExitedWithCode(0), "force;(zero;)+$");
}

}  // namespace
}  // namespace hapticd::phantom
