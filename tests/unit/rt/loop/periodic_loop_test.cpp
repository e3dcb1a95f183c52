#include "rt/loop/periodic_loop.h"

#include <gtest/gtest.h>

#include <chrono>
#include <cmath>
#include <cstdlib>
#include <thread>
#include <vector>

#include "fake_rig.h"
#include "tests/support/quiet_loop.h"

namespace hapticd::rt {
namespace {

/// Waits for the rig to run out.
void await_end(const PeriodicLoop& loop) {
  while (loop.running()) std::this_thread::sleep_for(std::chrono::milliseconds(1));
}

TEST(PeriodicLoop, RunsAPacedRigToItsEndAndLeavesZeroForce) {
  FakeRig rig;
  rig.end_after = 100;
  rig.last_command.force_n.z = 3.0;
  Engine engine(rig);
  PeriodicLoop loop(rig, engine, test::quiet_loop());
  loop.start();
  await_end(loop);
  loop.stop();
  EXPECT_EQ(loop.statistics().ticks, 100U);
  EXPECT_EQ(loop.statistics().compute.count, 100U);
  EXPECT_EQ(rig.writes, 101U) << "one a tick, and the zero at the end";
  EXPECT_EQ(rig.last_command.force_n.z, 0.0);
}

TEST(PeriodicLoop, ProcessesTickAtDifferentTimes) {
  constexpr std::int64_t kPeriodNs = 1'000'000;
  for (const std::int64_t first : {1, 1234, 4'194'290}) {
    for (std::int64_t one = first; one < first + 12; ++one) {
      const std::int64_t phase_ns = tick_phase_ns(one, kPeriodNs);
      EXPECT_GE(phase_ns, kPeriodNs / 4);
      EXPECT_LE(phase_ns, 3 * kPeriodNs / 4);
      for (std::int64_t other = one + 1; other < first + 12; ++other)
        EXPECT_GT(std::abs(phase_ns - tick_phase_ns(other, kPeriodNs)), 20'000) << one << ", " << other;
    }
  }
}

TEST(PeriodicLoop, LendsItsThreadToARigThatOwnsTheClock) {
  FakeRig rig(true);
  rig.end_after = 5000;
  Engine engine(rig);
  PeriodicLoop loop(rig, engine, test::quiet_loop());
  loop.start();
  await_end(loop);
  EXPECT_EQ(engine.last_tick(), 4999U);
  EXPECT_EQ(loop.statistics().ticks, 0U) << "the loop's own clock never ran";
}

TEST(PeriodicLoop, ASlowDeviceIsNamedAsTheCauseOfTheOverrun) {
  FakeRig rig;
  rig.end_after = 60;
  rig.before_read = [](std::uint64_t tick) {
    if (tick == 30) std::this_thread::sleep_for(std::chrono::milliseconds(300));
  };
  Engine engine(rig);
  PeriodicLoop loop(rig, engine, test::quiet_loop());
  loop.start();
  await_end(loop);
  loop.stop();
  EXPECT_GE(loop.statistics().overruns_by_device, 1U);
  EXPECT_GE(loop.statistics().jitter.max_ns, 298'000'000) << "a missed period is jitter, too";
  EXPECT_GE(loop.statistics().periods_missed, 299U) << "skipped and counted, not caught up";
  TickRecord record;
  bool reported = false;
  while (engine.pop_record(record)) {
    if (record.tick == 31) {
      reported = record.timing.overrun == OverrunCause::kDevice && record.timing.periods_missed >= 299 &&
                 record.timing.device_ns >= 0;
    }
  }
  EXPECT_TRUE(reported) << "the record after the overrun names it";
}

TEST(PeriodicLoop, NoTickBeginsBeforeItsTimeHoweverEarlyTheThreadIsWoken) {
  using Clock = std::chrono::steady_clock;
  for (const double share : {0.0, 0.05, 0.5}) {
    FakeRig rig;
    rig.end_after = 200;
    std::vector<Clock::time_point> begun;
    rig.before_read = [&begun](std::uint64_t) { begun.push_back(Clock::now()); };
    Engine engine(rig);
    LoopConfig config = test::quiet_loop();
    config.wake_early_share = share;
    PeriodicLoop loop(rig, engine, config);
    loop.start();
    await_end(loop);
    loop.stop();
    const LoopStatistics statistics = loop.statistics();
    EXPECT_EQ(statistics.timer.count, 200U);
    EXPECT_EQ(statistics.jitter.count, 199U);
    // Each tick has a separate place on the grid, so n ticks take n periods, but for what the first was late.
    const std::int64_t periods = 199 + static_cast<std::int64_t>(statistics.periods_missed);
    const auto took = begun.back() - begun.front();
    EXPECT_GE(took + std::chrono::nanoseconds(statistics.wakeup.max_ns),
              (periods - 1) * std::chrono::milliseconds(1))
        << share;
    // What is slept early makes up for what the timer was late, and never more. By the median: who waits
    // awake may be interrupted, too.
    const auto timer_ns = static_cast<double>(statistics.timer.quantile_ns(0.5));
    EXPECT_LE(static_cast<double>(statistics.wakeup.quantile_ns(0.5)), timer_ns + 1000.0) << share;
  }
}

TEST(PeriodicLoop, SaysWhatItLacks) {
  FakeRig rig;
  rig.end_after = 1;
  Engine engine(rig);
  LoopConfig config = test::quiet_loop();
  config.cpu = 0;
  PeriodicLoop loop(rig, engine, config);
  loop.start();
  await_end(loop);
  for (const std::string& line : loop.shortcomings()) EXPECT_NE(line.find(';'), std::string::npos) << line;
}

TEST(LoopConfig, IsCheckedBeforeAnyThreadExists) {
  LoopConfig config;
  EXPECT_TRUE(validate(config));
  for (const double rate : {0.0, 499.0, 10001.0, std::nan("")}) {
    LoopConfig bad{.rate_hz = rate};
    ASSERT_FALSE(validate(bad));
    EXPECT_EQ(validate(bad).error().what, "rate_hz is out of range");
    EXPECT_EQ(validate(bad).error().limit, "500 … 10000 Hz");
  }
  EXPECT_EQ(validate({.fifo_priority = 100}).error().what, "fifo_priority is out of range");
  for (const double share : {-0.01, 0.51, std::nan("")}) {
    LoopConfig early{.wake_early_share = share};
    ASSERT_FALSE(validate(early));
    EXPECT_EQ(validate(early).error().what, "wake_early_share is out of range");
  }
  LoopConfig cpu{.cpu = 100000};
  EXPECT_EQ(validate(cpu).error().what, "cpu does not exist");
}

}  // namespace
}  // namespace hapticd::rt
