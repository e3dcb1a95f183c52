// Ticks that come late, and sensor samples that are lost or come in bunches.

#include "hal/sim/tick_clock.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>

#include "tests/support/ticks/tick_sequence.h"
#include "tests/support/value_of.h"
#include "virtual_rig.h"

namespace hapticd::sim {
namespace {

using test::TickSequence;
using test::VirtualRig;

SimulationConfig on(const TickSequence& ticks, double rate_hz = 1000.0) {
  return {.object = "none", .rate_hz = rate_hz, .ticks = ticks.shared()};
}

class Recorded : public testing::Test {
 protected:
  ~Recorded() override { std::filesystem::remove(path_); }
  hal::Result<TickSequence> load(const std::string& text) {
    std::ofstream(path_) << text;
    return TickSequence::load(path_);
  }
  const std::string path_ =
      (std::filesystem::temp_directory_path() / ("ticks_" + std::to_string(::getpid()) + ".csv")).string();
};

TEST_F(Recorded, RecordsThatAreMissingAreLate) {
  // 7 records a tick; the fourth tick has none, the fifth all that were missing.
  std::string text = "interval_us,sensor_records\n";
  for (const int records : {7, 7, 7, 0, 14, 7, 7}) text += "1000.0," + std::to_string(records) + "\n";
  const auto sequence = test::value_of(load(text));
  ASSERT_EQ(sequence.ticks().size(), 7U);
  EXPECT_EQ(sequence.ticks()[2].sensor_late_us, 0.0);
  EXPECT_NEAR(sequence.ticks()[3].sensor_late_us, 1000.0, 1e-6);
  EXPECT_EQ(sequence.ticks()[4].sensor_late_us, 0.0);
}

TEST_F(Recorded, WhatIsNoSequenceIsRefused) {
  EXPECT_FALSE(TickSequence::load("/nowhere.csv"));
  EXPECT_FALSE(load(""));
  EXPECT_FALSE(load("interval_us\n1000\n"));
  EXPECT_FALSE(load("interval_us,sensor_records\n"));
  EXPECT_FALSE(load("interval_us,sensor_records\n1000,seven\n"));
  EXPECT_FALSE(load("interval_us,sensor_records\n-3,7\n"));
  EXPECT_FALSE(load("interval_us,sensor_records\n1000\n"));
}

TEST_F(Recorded, TheRealRecordingsPlay) {
  const char* folder = std::getenv("HAPTICD_RECORDINGS");
  if (folder == nullptr) GTEST_SKIP() << "HAPTICD_RECORDINGS is not set: no real tick intervals";
  for (const char* name : {"idle", "loaded"}) {
    const auto sequence =
        test::value_of(TickSequence::load(std::string(folder) + "/tick_intervals/" + name + ".csv"));
    EXPECT_GT(sequence.ticks().size(), 50'000U);
    double longest_us = 0.0, max_late_us = 0.0;
    for (const TickInterval& tick : sequence.ticks()) {
      longest_us = std::max(longest_us, tick.interval_us);
      max_late_us = std::max(max_late_us, tick.sensor_late_us);
    }
    EXPECT_GT(longest_us, 5000.0) << name;
    EXPECT_GT(max_late_us, 5000.0) << name;
    VirtualRig rig(on(sequence));
    double passed_us = 0.0;
    for (std::size_t i = 0; i < 5000; ++i) {
      rig.tick();
      passed_us += sequence.ticks()[i].interval_us;
      ASSERT_NEAR(static_cast<double>(rig.sample().time_ns), 1e3 * passed_us, 2.0);
    }
  }
}

TEST(LateTick, AdvancesTheWorldByJustItsInterval) {
  for (const double late_us : {100.0, 300.0, 950.0, 1700.0, 20'000.0, 200'000.0}) {
    const TickSequence ticks = TickSequence::late(1000.0, late_us, 50);
    VirtualRig rig(on(ticks));
    std::int64_t last_ns = 0;
    for (int round = 0; round < 3; ++round) {
      for (const TickInterval& tick : ticks.ticks()) {
        rig.tick();
        ASSERT_NEAR(static_cast<double>(rig.sample().time_ns - last_ns), 1e3 * tick.interval_us, 2.0);
        last_ns = rig.sample().time_ns;
      }
      // Back on even times after each.
      EXPECT_NEAR(std::remainder(1e-3 * static_cast<double>(last_ns), 1000.0), 0.0, 0.01);
    }
  }
}

TEST(LateTick, TheEncodersShowTheTipOfThatVeryInstant) {
  const HandProgram sway{
      .kind = HandProgram::Kind::kSway, .speed_mm_per_s = 276.0, .rate_hz = 2.2, .hold_s = -1.0};
  SimulationConfig even{.object = "none", .rate_hz = 10000.0};
  SimulationConfig late = on(TickSequence({{1000.0}, {1337.0}, {663.0}}));
  VirtualRig reference(even, sway), rig(late, sway);
  rig.run(3.0);
  for (int i = 0; i < 300; ++i) {
    rig.tick();
    while (reference.sample().time_ns + 100'000 <= rig.sample().time_ns) reference.tick();
    const double beyond_s = 1e-9 * static_cast<double>(rig.sample().time_ns - reference.sample().time_ns);
    ASSERT_GE(beyond_s, 0.0);
    const double before_mm = reference.sample().tip_position_mm.x;
    ASSERT_NEAR(rig.sample().tip_position_mm.x, before_mm, 0.03 + 0.06) << "a count and 0.1 ms of 0.3 m/s";
  }
}

TEST(LateTick, BurstsAndRatesKeepTheirLateness) {
  const TickSequence burst = TickSequence::bursts(1000.0, 700.0, 3, 10);
  int late = 0;
  double total_us = 0.0;
  for (const TickInterval& tick : burst.ticks()) {
    late += tick.interval_us == 1700.0 ? 1 : 0;
    total_us += tick.interval_us;
  }
  EXPECT_EQ(late, 3);
  EXPECT_NEAR(std::remainder(total_us, 1000.0), 0.0, 1e-9);
  const TickSequence fast = TickSequence::late(1000.0, 3000.0, 10).at_rate(1000.0, 5000.0);
  double longest_us = 0.0, sum_us = 0.0;
  for (const TickInterval& tick : fast.ticks()) {
    EXPECT_GE(tick.interval_us, 10.0 - 1e-9);
    longest_us = std::max(longest_us, tick.interval_us);
    sum_us += tick.interval_us;
  }
  EXPECT_NEAR(longest_us, 3200.0, 1e-6);
  EXPECT_NEAR(sum_us, 15'000.0, 400.0) << "the same time in all";
}

TEST(LateTick, RandomOnesComeAsOftenAsAsked) {
  SimulationConfig config;
  config.object = "none";
  config.condition_values = {
      {"late_tick_share", 0.1}, {"late_tick_ms", 0.2}, {"stall_interval_s", 2.0}, {"stall_ms", 20.0}};
  VirtualRig rig(config);
  std::int64_t last_ns = 0;
  int late = 0, stalls = 0, ticks = 0;
  rig.run(60.0, [&] {
    const double interval_us = 1e-3 * static_cast<double>(rig.sample().time_ns - last_ns);
    ASSERT_GT(interval_us, 0.0);
    last_ns = rig.sample().time_ns;
    late += interval_us > 1001.0 ? 1 : 0;
    stalls += interval_us > 15'000.0 ? 1 : 0;
    ++ticks;
  });
  EXPECT_NEAR(static_cast<double>(late) / ticks, 0.1, 0.02);
  EXPECT_NEAR(stalls, 30, 18);
}

TEST(SensorSamples, ThoseThatAreLateComeInOneBunchWithTheirTrueAge) {
  SimulationConfig config = on(TickSequence::bunched(1000.0, 3000.0, 20));
  config.condition_values = {{"delays_reported", 1.0}};
  VirtualRig rig(config);
  std::uint64_t samples = 0;
  int missing = 0;
  bool bunch = false;
  rig.run(2.0, [&] {
    const hal::RigSample& s = rig.sample();
    samples += s.force_count;
    const bool none = (s.status & hal::sample_status::kForceMissing) != 0;
    ASSERT_EQ(none, s.force_count == 0);
    missing += none ? 1 : 0;
    bunch = bunch || s.force_count == 40;
    if (none) {
      ASSERT_GE(s.force_age_ns, 1'000'000);
    } else {
      ASSERT_EQ(s.force_mean_age_ns - s.force_age_ns,
                (static_cast<std::int64_t>(s.force_count) - 1) * 50'000);
    }
  });
  EXPECT_TRUE(bunch);
  EXPECT_GT(missing, 100);
  EXPECT_NEAR(static_cast<double>(samples), 20'000.0, 50.0) << "none is lost";
}

TEST(SensorSamples, WithoutAStampTheyCountAsNewWhenTheyArrive) {
  VirtualRig rig(on(TickSequence::bunched(1000.0, 3000.0, 20)));
  rig.run(1.0, [&] {
    if (rig.sample().force_count > 0) {
      ASSERT_EQ(rig.sample().force_age_ns, 0);
    }
  });
}

TEST(SensorSamples, LostOnesNeverCome) {
  VirtualRig rig(on(TickSequence::lost(1000.0, 2, 8)));
  std::uint64_t samples = 0;
  int missing = 0;
  rig.run(2.0, [&] {
    samples += rig.sample().force_count;
    missing += (rig.sample().status & hal::sample_status::kForceMissing) != 0 ? 1 : 0;
    ASSERT_LE(rig.sample().force_count, 10U);
  });
  EXPECT_EQ(missing, 400);
  EXPECT_EQ(samples, 16'000U);
}

}  // namespace
}  // namespace hapticd::sim
