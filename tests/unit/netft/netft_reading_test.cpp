// What a tick gets of a stream that is well.

#include <gtest/gtest.h>

#include <limits>
#include <thread>

#include "../allocation_counter.h"
#include "netft_bench.h"

namespace hapticd::netft {
namespace {

namespace status = hal::sample_status;

TEST(NetFtReading, IsTheMeanOfTheSamplesSinceTheLastTick) {
  FedBench bench;
  ASSERT_FALSE(bench.engage());
  for (int i = 1; i <= 4; ++i) {
    bench.feed({0.5 * i, -1.0 * i, 2.0 * i}, {10.0 * i, 0.0, -20.0 * i});
  }
  const hal::RigSample sample = bench.read();
  EXPECT_EQ(sample.force_count, 4U);
  EXPECT_EQ(sample.status, 0U);
  EXPECT_NEAR(sample.sensor_force_n.x, 1.25, 1e-6);
  EXPECT_NEAR(sample.sensor_force_n.y, -2.5, 1e-6);
  EXPECT_NEAR(sample.sensor_force_n.z, 5.0, 1e-6);
  EXPECT_NEAR(sample.sensor_torque_n_mm.x, 25.0, 1e-3);
  EXPECT_NEAR(sample.sensor_torque_n_mm.z, -50.0, 1e-3);
}

TEST(NetFtReading, SaysWhichInstantTheMeanStandsFor) {
  NetFtBench bench;
  ASSERT_FALSE(bench.engage());
  EXPECT_EQ(bench.box.page().requests() > 0, true);
  ASSERT_TRUE(eventually([&] { return bench.figure("samples") > 5000.0; }));
  bench.read();
  int looked = 0;
  ASSERT_TRUE(eventually([&] {
    std::this_thread::sleep_for(std::chrono::milliseconds(2));
    const hal::RigSample sample = bench.read();
    if (sample.force_count < 5) return false;
    // Evenly measured at 7 kHz, however they arrived: the middle is half of them before the newest.
    const double half_ns = 0.5 * (sample.force_count - 1) * 1e9 / 7000.0;
    EXPECT_GE(static_cast<double>(sample.force_mean_age_ns),
              static_cast<double>(sample.force_age_ns) + 0.5 * half_ns);
    return ++looked == 20;
  }));
  bench.sensor->disengage();
  const std::int64_t before_ns = bench.read().force_mean_age_ns;
  EXPECT_GT(bench.read().force_mean_age_ns, before_ns) << "a mean that is kept grows old";
}

TEST(NetFtReading, KeepsTheLastMeanAndSaysSoWhenNothingCame) {
  FedBench bench;
  ASSERT_FALSE(bench.engage());
  bench.feed({3.0, 0.0, 0.0});
  const hal::RigSample fresh = bench.read();
  const hal::RigSample first = bench.read();
  const hal::RigSample second = bench.read();
  EXPECT_EQ(first.status, status::kForceMissing);
  EXPECT_EQ(first.force_count, 0U);
  EXPECT_NEAR(first.sensor_force_n.x, 3.0, 1e-6);
  EXPECT_GE(fresh.force_age_ns, 0);
  EXPECT_GT(first.force_age_ns, fresh.force_age_ns);
  EXPECT_GT(second.force_age_ns, first.force_age_ns);
}

TEST(NetFtReading, TouchesOnlyItsHalfOfTheSample) {
  FedBench bench;
  ASSERT_FALSE(bench.engage());
  bench.feed({1.0, 0.0, 0.0});
  hal::RigSample sample;
  sample.tick = 7;
  sample.time_ns = 11;
  sample.tip_position_mm = {1.0, 2.0, 3.0};
  sample.status = status::kDeviceWarm;
  bench.sensor->read(sample);
  EXPECT_EQ(sample.tick, 7U);
  EXPECT_EQ(sample.time_ns, 11);
  EXPECT_EQ(sample.tip_position_mm.y, 2.0);
  EXPECT_EQ(sample.status, status::kDeviceWarm);
}

TEST(NetFtReading, AfterALongPauseOnlyTheNewestSampleSaysOfNow) {
  emulators::NetFtBoxSettings settings;
  settings.continue_sequence = true;  // the silence makes the sensor ask for the stream again
  FedBench bench(settings);
  bench.config.stale_after_ms = 100.0;
  ASSERT_FALSE(bench.engage());
  bench.feed({-5.0, 0.0, 0.0});
  bench.feed({-5.0, 0.0, 0.0});
  std::this_thread::sleep_for(std::chrono::milliseconds(150));
  const double skipped = bench.figure("samples_skipped");
  bench.feed({4.0, 0.0, 0.0});
  const hal::RigSample sample = bench.read();
  EXPECT_EQ(sample.force_count, 1U);
  EXPECT_NEAR(sample.sensor_force_n.x, 4.0, 1e-6);
  EXPECT_EQ(bench.figure("samples_skipped") - skipped, 2.0);
}

TEST(NetFtReading, BelievesCountsGivenByHandWhereThereIsNoPage) {
  emulators::NetFtBoxSettings settings{.counts_per_force = 4000.0,
                                       .counts_per_torque = 200.0,
                                       .force_unit = "lbf",
                                       .torque_unit = "Nmm",
                                       .has_page = false};
  FedBench bench(settings);
  bench.config.read_configuration = false;
  bench.config.counts_per_force = 4000.0;
  bench.config.counts_per_torque = 200.0;
  bench.config.force_unit = "lbf";
  bench.config.torque_unit = "Nmm";
  const auto error = bench.engage();
  ASSERT_FALSE(error) << error->text();
  bench.feed({0.0, 0.0, -10.0}, {100.0, 0.0, 0.0});
  const hal::RigSample sample = bench.read();
  EXPECT_NEAR(sample.sensor_force_n.z, -10.0, 1e-3);
  EXPECT_NEAR(sample.sensor_torque_n_mm.x, 100.0, 5e-3);
}

TEST(NetFtReading, TakesDatagramsOfSeveralRecords) {
  FedBench bench({.records_per_datagram = 5});
  ASSERT_FALSE(bench.engage());
  for (int i = 0; i < 5; ++i) bench.box.feed({2.0, 0.0, 0.0}, {});  // ends what was begun
  bench.settle();
  const double before = bench.figure("samples");
  for (int i = 0; i < 20; ++i) bench.box.feed({2.0, 0.0, 0.0}, {});
  ASSERT_TRUE(eventually([&] { return bench.figure("samples") == before + 20.0; }));
  EXPECT_NEAR(bench.read().sensor_force_n.x, 2.0, 1e-6);
}

TEST(NetFtReading, AllocatesNothing) {
  FedBench bench;
  ASSERT_FALSE(bench.engage());
  hal::RigSample sample;
  for (int i = 0; i < 20; ++i) {
    bench.feed({1.0, 1.0, 1.0});
    const long before = test::allocations();
    bench.sensor->read(sample);
    EXPECT_EQ(test::allocations(), before);
    EXPECT_EQ(sample.force_count, 1U);
  }
}

TEST(NetFtReading, BeforeAndAfterEngagementSaysThatNothingIsThere) {
  FedBench bench;
  auto made = NetFtSensor::create(bench.config);
  ASSERT_TRUE(made);
  hal::RigSample sample;
  (*made)->read(sample);
  EXPECT_EQ(sample.status, status::kForceMissing);
  EXPECT_EQ(sample.force_age_ns, std::numeric_limits<std::int64_t>::max());

  ASSERT_FALSE(bench.engage());
  bench.feed({1.0, 0.0, 0.0});
  EXPECT_EQ(bench.read().status, 0U);
  bench.sensor->disengage();
  sample = bench.read();
  EXPECT_EQ(sample.status, status::kForceMissing);
  EXPECT_EQ(sample.force_count, 0U);
  EXPECT_EQ(sample.force_age_ns, std::numeric_limits<std::int64_t>::max());
}

TEST(NetFtReading, KeepsUpWithSevenThousandSamplesASecond) {
  NetFtBench bench;
  bench.box.load({0.0, 0.0, 1.5}, {});
  ASSERT_FALSE(bench.engage());
  bench.read();
  std::uint64_t samples = 0;
  const std::uint64_t made_before = bench.box.records_made();
  for (int i = 0; i < 300; ++i) {
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
    const hal::RigSample sample = bench.read();
    samples += sample.force_count;
    EXPECT_NEAR(sample.sensor_force_n.z, 1.5, 1e-6);
  }
  EXPECT_GT(samples, 0U);
  EXPECT_LE(samples, bench.box.records_made() - made_before + 7000);
  EXPECT_EQ(bench.figure("duplicates"), 0.0);
  EXPECT_EQ(bench.figure("overtaken"), 0.0);
  EXPECT_EQ(bench.figure("malformed_datagrams"), 0.0);
}

}  // namespace
}  // namespace hapticd::netft
