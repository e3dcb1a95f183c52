// The sensor on a board that works: load, mean, bias, axes, information, cost.

#include "hal/daq/daq_sensor.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <thread>

#include "../allocation_counter.h"
#include "daq_bench.h"

namespace hapticd::daq {
namespace {

using test::DaqBench;
namespace status = hal::sample_status;

/// A bias is taken by the next read, which another thread does meanwhile.
void bias_while_read(DaqBench& bench) {
  std::atomic<bool> done{false};
  std::thread reader([&] {
    while (!done.load()) {
      bench.read();
      std::this_thread::sleep_for(std::chrono::microseconds(200));
    }
  });
  EXPECT_FALSE(bench.sensor->bias());
  done.store(true);
  reader.join();
}

TEST(DaqSensor, TellsTheLoadToTheConvertersResolution) {
  DaqBench bench;
  bench.engage();
  const hal::Vector3 force{3.0, -2.0, 9.0};
  const hal::Vector3 torque{30.0, -45.0, 12.0};
  bench.board->feed(force, torque);
  const hal::RigSample sample = bench.tick();
  EXPECT_EQ(sample.status, 0U);
  EXPECT_EQ(sample.force_count, 10U) << "ten scans of 10 kHz in a millisecond";
  // One step of a 16-bit converter over 20 V is 0.3 mV; the rows are below 10 N/V and 60 N·mm/V.
  EXPECT_NEAR(sample.sensor_force_n.x, force.x, 0.005);
  EXPECT_NEAR(sample.sensor_force_n.y, force.y, 0.005);
  EXPECT_NEAR(sample.sensor_force_n.z, force.z, 0.005);
  EXPECT_NEAR(sample.sensor_torque_n_mm.x, torque.x, 0.04);
  EXPECT_NEAR(sample.sensor_torque_n_mm.y, torque.y, 0.04);
  EXPECT_NEAR(sample.sensor_torque_n_mm.z, torque.z, 0.04);
  EXPECT_GE(sample.force_age_ns, 0);
  EXPECT_LE(sample.force_age_ns, 100'000) << "the newest scan is at most a period old";
}

TEST(DaqSensor, IsTheMeanSinceTheLastTick) {
  DaqBench bench;
  bench.engage();
  bench.tick();
  bench.board->feed({0.0, 0.0, 2.0}, {});
  bench.pass_ms(0.4);
  bench.board->feed({0.0, 0.0, 7.0}, {});
  bench.pass_ms(0.6);
  const hal::RigSample sample = bench.read();
  EXPECT_EQ(sample.force_count, 10U);
  EXPECT_NEAR(sample.sensor_force_n.z, 0.4 * 2.0 + 0.6 * 7.0, 0.005);
}

TEST(DaqSensor, EngagingTakesTheFirstQuarterSecondAsZeroAndOnlyTheFirst) {
  DaqBench bench;
  bench.board->feed({0.0, 0.0, 1.0}, {});  // say, the tool's weight
  bench.engage();
  EXPECT_NEAR(bench.tick().sensor_force_n.z, 0.0, 0.003);
  bench.sensor->disengage();
  EXPECT_FALSE(bench.board->engaged(BoardUse::kInputs));
  bench.board->feed({0.0, 0.0, 3.0}, {});
  std::thread clock([&] {
    for (int k = 0; k < 1000 && !bench.board->engaged(BoardUse::kInputs); ++k) {
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
    bench.pass_ms(5.0);
  });
  ASSERT_FALSE(bench.sensor->engage());
  clock.join();
  EXPECT_NEAR(bench.tick().sensor_force_n.z, 2.0, 0.005) << "the bias outlasts an interruption";
}

TEST(DaqSensor, WithoutABiasTheGaugesOffsetsShow) {
  DaqBench bench({}, {.bias_on_engage = false});
  bench.engage();
  const hal::RigSample sample = bench.tick();
  const hal::Vector3& f = sample.sensor_force_n;
  EXPECT_GT(std::sqrt(dot(f, f)), 0.5);
}

TEST(DaqSensor, BiasTakesTheMeanOfTheLastQuarterSecond) {
  DaqBench bench({.gauge_noise_v = 0.05});
  bench.engage();
  bench.board->feed({1.0, 2.0, -3.0}, {10.0, 20.0, 30.0});
  for (int k = 0; k < 300; ++k) bench.tick();
  bias_while_read(bench);
  bench.tick();
  hal::Vector3 mean;
  for (int k = 0; k < 300; ++k) mean = mean + bench.tick().sensor_force_n * (1.0 / 300.0);
  // 2500 scans of ± 50 mV leave 0.6 mV; times at most 10 N/V, thrice.
  EXPECT_NEAR(mean.x, 0.0, 0.02);
  EXPECT_NEAR(mean.y, 0.0, 0.02);
  EXPECT_NEAR(mean.z, 0.0, 0.02);
}

TEST(DaqSensor, ABiasThatWasAnsweredWithAnErrorIsNeverTaken) {
  DaqBench bench;
  bench.engage();
  for (int k = 0; k < 20; ++k) bench.tick();
  bench.board->feed({0.0, 0.0, 5.0}, {});
  EXPECT_TRUE(bench.sensor->bias());
  EXPECT_TRUE(bench.sensor->report().findings.empty()) << "nothing is pending";
  const std::uint32_t serial = bench.tick().bias_serial;
  for (int k = 0; k < 600; ++k) bench.tick();
  EXPECT_NEAR(bench.tick().sensor_force_n.z, 5.0, 0.005) << "the load of later is no zero";
  EXPECT_EQ(bench.tick().bias_serial, serial);
}

TEST(DaqSensor, ABiasThatWasAskedForBeforeItWasEngagedIsNeverTaken) {
  DaqBench bench;
  EXPECT_TRUE(bench.sensor->bias());
  bench.engage();
  bench.board->feed({0.0, 0.0, 5.0}, {});
  for (int k = 0; k < 600; ++k) bench.tick();
  EXPECT_NEAR(bench.tick().sensor_force_n.z, 5.0, 0.005);
}

TEST(DaqSensor, TheMeanStandsForTheMiddleOfItsScansHoweverTheyCame) {
  DaqBench bench;
  bench.engage();
  for (int k = 0; k < 500; ++k) {
    // Ticks come late and early; ten scans a millisecond were taken all the same.
    const double ms = k % 3 == 0 ? 2.4 : 0.4;
    bench.pass_ms(ms);
    const hal::RigSample sample = bench.read();
    ASSERT_EQ(sample.status, 0U);
    ASSERT_GT(sample.force_count, 0U);
    const double half_ms = 0.05 * (sample.force_count - 1);
    EXPECT_NEAR(1e-6 * static_cast<double>(sample.force_mean_age_ns - sample.force_age_ns), half_ms, 0.06)
        << "tick " << k;
  }
  bench.sensor->disengage();
  EXPECT_EQ(bench.read().force_mean_age_ns, std::numeric_limits<std::int64_t>::max());
}

TEST(DaqSensor, EveryBiasChangesTheSerialNumberWithTheFirstSampleThatUsesIt) {
  DaqBench bench;
  EXPECT_EQ(bench.read().bias_serial, 0U);
  bench.engage();
  EXPECT_EQ(bench.tick().bias_serial, 1U) << "the one taken while engaging";
  bench.board->feed({0.0, 0.0, 5.0}, {});
  for (int k = 0; k < 300; ++k) bench.tick();
  bias_while_read(bench);
  const hal::RigSample after = bench.tick();
  EXPECT_EQ(after.bias_serial, 2U);
  EXPECT_NEAR(after.sensor_force_n.z, 0.0, 0.005);
  bench.sensor->disengage();
  EXPECT_EQ(bench.read().bias_serial, 2U) << "let go, and still the same zero";
}

TEST(DaqSensor, AxesAreTheToolsInTheSensors) {
  DaqBench bench({}, {.axes = "-y +x +z"});
  bench.engage();
  bench.board->feed({1.0, 2.0, 3.0}, {10.0, 20.0, 30.0});
  const hal::RigSample sample = bench.tick();
  EXPECT_NEAR(sample.sensor_force_n.x, -2.0, 0.005);
  EXPECT_NEAR(sample.sensor_force_n.y, 1.0, 0.005);
  EXPECT_NEAR(sample.sensor_force_n.z, 3.0, 0.005);
  EXPECT_NEAR(sample.sensor_torque_n_mm.x, -20.0, 0.04);
  EXPECT_NEAR(sample.sensor_torque_n_mm.y, 10.0, 0.04);
}

TEST(DaqSensor, SaysWhatItIs) {
  DaqBench bench;
  const hal::SensorInfo& info = bench.sensor->info();
  EXPECT_EQ(info.model, "nano17_si_25_0_25");
  EXPECT_DOUBLE_EQ(info.range_n, 35.0);
  EXPECT_DOUBLE_EQ(info.sample_rate_hz, 10000.0);
  EXPECT_GT(info.resolution_n, 0.0005);
  EXPECT_LT(info.resolution_n, 0.005);
}

TEST(DaqSensor, NotEngagedItHasNothing) {
  DaqBench bench;
  const hal::RigSample sample = bench.read();
  EXPECT_EQ(sample.status, status::kForceMissing);
  EXPECT_EQ(sample.force_count, 0U);
  EXPECT_EQ(sample.force_age_ns, std::numeric_limits<std::int64_t>::max());
  EXPECT_EQ(bench.sensor->report().state, hal::PartState::kIdle);
  EXPECT_TRUE(bench.sensor->bias());
}

TEST(DaqSensor, WrongConfigurationsAreRefused) {
  const test::TemporaryFolder folder;
  const auto board = std::make_shared<emulators::ScriptedBoard>();
  DaqSensorConfig good;
  good.calibration_file = folder.write("sensor.cal", board->gauges().calibration_file({}));
  EXPECT_TRUE(DaqSensor::create(good, board));
  const auto error_of = [&](auto change) {
    DaqSensorConfig config = good;
    change(config);
    const auto made = DaqSensor::create(config, board);
    return made ? std::string("made") : made.error().text();
  };
  EXPECT_NE(error_of([](auto& c) { c.axes = "+x +x +z"; }).find("axes"), std::string::npos);
  EXPECT_NE(error_of([](auto& c) { c.saturation_share = 0.0; }).find("saturation"), std::string::npos);
  EXPECT_NE(error_of([](auto& c) { c.calibration_file = ""; }).find("calibration_file"), std::string::npos);
  EXPECT_NE(error_of([](auto& c) { c.calibration_file = "/no/such.cal"; }).find("/no/such.cal"),
            std::string::npos);
  EXPECT_NE(error_of([](auto& c) { c.part_number = "SI-1-1"; }).find("SI-1-1"), std::string::npos);
  EXPECT_FALSE(DaqSensor::create(good, nullptr));
}

TEST(DaqSensor, ATickAsksForNoMemory) {
  DaqBench bench;
  bench.engage();
  // The scripted board keeps its scans in a deque; let it have all it wants before we count.
  for (int k = 0; k < 400; ++k) bench.tick();
  class SilentBoard final : public Board {
   public:
    BoardInfo info() const override { return {.inputs = 6}; }
    ScanReading take_scans(std::span<Scan> scans) noexcept override {
      for (std::size_t k = 0; k < 10; ++k) scans[k].time_ns = now_ns();
      return {.count = 10, .running = true, .newest_ns = now_ns()};
    }
    void describe(hal::PartReport&) const override {}

   protected:
    std::optional<hal::Error> open(BoardUse) override { return std::nullopt; }
    void close(BoardUse) noexcept override {}
    bool read_raw_counters(std::span<std::uint64_t>) noexcept override { return false; }
    bool put_volts(std::span<const double>) noexcept override { return true; }
  };
  DaqSensorConfig config{.calibration_file = bench.folder.path("sensor.cal")};
  auto made = DaqSensor::create(config, std::make_shared<SilentBoard>());
  ASSERT_TRUE(made);
  ASSERT_FALSE((*made)->engage());
  hal::RigSample sample;
  const long before = test::allocations();
  for (int k = 0; k < 10000; ++k) (*made)->read(sample);
  EXPECT_EQ(test::allocations(), before);
  EXPECT_EQ(sample.force_count, 10U);
}

}  // namespace
}  // namespace hapticd::daq
