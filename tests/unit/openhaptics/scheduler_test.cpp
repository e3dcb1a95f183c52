#include <gtest/gtest.h>

#include <chrono>
#include <thread>
#include <vector>

#include "../allocation_counter.h"
#include "hd_bench.h"

namespace hapticd::test {
namespace {

/// The events from a given one on.
std::vector<HdEvent> from(const std::vector<HdEvent>& events, HdEvent first) {
  const auto begin = std::find(events.begin(), events.end(), first);
  return {begin, events.end()};
}

TEST(OpenHapticsScheduler, RunsTheBodyOncePerTickAndLeavesWithTheForceOff) {
  HdBench bench;
  bench.body->ask({0.0, 0.0, 1.0});
  ASSERT_TRUE(bench.runs(50));
  ASSERT_TRUE(bench.feels(1.0));
  EXPECT_TRUE(bench.leaves_clean());
  EXPECT_EQ(
      from(bench.page.events(), HdEvent::kForceFrame),
      (std::vector<HdEvent>{HdEvent::kForceFrame, HdEvent::kZeroFrame, HdEvent::kForceOff, HdEvent::kStop,
                            HdEvent::kForceOff, HdEvent::kForceOff, HdEvent::kDisable, HdEvent::kUnloaded}));
}

TEST(OpenHapticsScheduler, TheStandInIsLateWhereItsPageSaysSo) {
  HdBench bench;
  std::vector<double> late_us(20, 0.0);
  late_us.push_back(8000.0);
  bench.page.set_late_ticks(late_us);
  ASSERT_TRUE(bench.runs(5));
  // A tick that is 8 ms late leaves 7 ms without one, whatever the machine does; even ticks leave none but by
  // the machine's own doing, and are in the majority.
  int gaps = 0;
  EXPECT_TRUE(eventually([&] {
    const std::uint64_t before = bench.body->calls();
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
    gaps += bench.body->calls() == before ? 1 : 0;
    return gaps >= 5;
  }));
  EXPECT_TRUE(bench.leaves_clean());
}

TEST(OpenHapticsScheduler, TheDestructorLeavesNoForceBehind) {
  HdBench bench;
  ASSERT_FALSE(bench.device->engage());
  bench.body->ask({1.0, 0.0, 1.0});
  bench.start_running();
  ASSERT_TRUE(bench.feels(1.0));
  bench.stop_running();
  bench.device = nullptr;
  EXPECT_TRUE(bench.left_clean());
}

TEST(OpenHapticsScheduler, DisengagingEndsARunUnderWay) {
  HdBench bench;
  ASSERT_TRUE(bench.renders(1.0));
  bench.device->disengage();
  EXPECT_TRUE(eventually([&] { return bench.returned.load(); }));
  EXPECT_TRUE(bench.left_clean());
  EXPECT_EQ(bench.device->report().state, hal::PartState::kIdle);
}

TEST(OpenHapticsScheduler, AskedToRunUnengagedReturnsAtOnce) {
  HdBench bench;
  bench.device->run(*bench.body, bench.stop);
  EXPECT_EQ(bench.body->calls(), 0U);
  hal::RigSample sample;
  bench.device->read(sample);
  EXPECT_EQ(sample.status, status::kDeviceNotReady);
  bench.device->write({{0.0, 0.0, 1.0}});  // into nothing
}

TEST(OpenHapticsScheduler, ASecondRunAtATimeIsRefusedAndOneAfterTheOtherIsNot) {
  HdBench bench;
  ASSERT_TRUE(bench.runs(5));
  Body other(*bench.device);
  bench.device->run(other, bench.stop);  // would hang here otherwise
  EXPECT_EQ(other.calls(), 0U);
  bench.stop_running();

  bench.body->ask({0.0, 0.0, 0.5});
  bench.start_running();
  ASSERT_TRUE(bench.ticks(5));
  EXPECT_TRUE(bench.feels(0.5));
  EXPECT_TRUE(bench.leaves_clean());
}

TEST(OpenHapticsScheduler, BetweenTwoRunsTheForceIsOffAndNothingIsMeasured) {
  HdBench bench;
  ASSERT_FALSE(bench.device->engage());
  EXPECT_FALSE(bench.page.device().force_enabled);
  bench.page.set_pose({1.0, 2.0, 3.0}, {});
  bench.body->ask({0.0, 0.0, 1.0});
  bench.start_running();
  ASSERT_TRUE(bench.ticks(5));
  EXPECT_TRUE(bench.page.device().force_enabled);
  bench.stop_running();
  EXPECT_FALSE(bench.page.device().force_enabled);
  EXPECT_FALSE(bench.page->scheduler_running);
  hal::RigSample sample;
  bench.device->read(sample);
  EXPECT_EQ(sample.status, status::kDeviceNotReady);
  EXPECT_DOUBLE_EQ(sample.tip_position_mm.z, 2.0);  // the last known
  bench.device->disengage();
  sample = {};
  bench.device->read(sample);
  EXPECT_EQ(sample.status, status::kDeviceNotReady);
  EXPECT_DOUBLE_EQ(sample.tip_position_mm.z, 2.0);
}

TEST(OpenHapticsScheduler, RunsAtTheRateItWasAskedFor) {
  HdBench bench([](OpenHapticsConfig& config) { config.rate_hz = 500.0; });
  ASSERT_FALSE(bench.device->engage());
  EXPECT_EQ(bench.page->scheduler_rate_hz, 500U);
  EXPECT_EQ(bench.page.events()[2], HdEvent::kRate);
  bench.start_running();
  EXPECT_TRUE(eventually([&] {
    const double rate_hz = bench.figure("scheduler_rate");
    return rate_hz > 450.0 && rate_hz < 550.0;
  }));
}

TEST(OpenHapticsScheduler, SaysWhenTheSchedulerIsSlow) {
  HdBench bench;
  bench.page->slow_hz = 400.0;
  ASSERT_FALSE(bench.device->engage());
  bench.start_running();
  EXPECT_TRUE(eventually([&] { return bench.finds("Hz instead of 1000"); }));
}

TEST(OpenHapticsScheduler, ARateTheDeviceDoesNotKnowIsAnError) {
  HdBench bench;
  bench.page->rate_error = 0x0101;
  const auto error = bench.device->engage();
  ASSERT_TRUE(error);
  EXPECT_NE(error->text().find("HD_INVALID_VALUE"), std::string::npos) << error->text();
  EXPECT_NE(error->remedy.find("1000"), std::string::npos);
  EXPECT_TRUE(bench.left_clean());
  EXPECT_EQ(bench.device->report().state, hal::PartState::kFaulty);
}

TEST(OpenHapticsScheduler, AFullSchedulerEndsTheRunAtOnceAndSaysWhy) {
  HdBench bench;
  ASSERT_FALSE(bench.device->engage());
  bench.page->schedule_error = 0x0501;
  bench.device->run(*bench.body, bench.stop);
  EXPECT_TRUE(bench.finds("HD_SCHEDULER_FULL"));
  EXPECT_FALSE(bench.page.device().force_enabled);
  bench.page->schedule_error = 0;
  bench.start_running();
  EXPECT_TRUE(bench.ticks(5));
  EXPECT_FALSE(bench.finds("HD_SCHEDULER_FULL"));
}

TEST(OpenHapticsScheduler, AStallIsAFaultUntilItIsOver) {
  HdBench bench;
  ASSERT_TRUE(bench.renders(1.0));
  bench.page->stall_ms = 1000;
  EXPECT_TRUE(eventually([&] { return bench.finds("scheduler does not call"); }));
  EXPECT_EQ(bench.device->report().state, hal::PartState::kFaulty);
  EXPECT_EQ(bench.page.force_n().y, 0.0);  // by the device's own watchdog: nothing else could
  // When it comes back the first sample shows it, and no force is given until that is over.
  EXPECT_TRUE(bench.sees(status::kDeviceFault));
  EXPECT_TRUE(bench.sees_no(status::kDeviceFault));
  EXPECT_TRUE(bench.feels(1.0));
  EXPECT_GE(bench.figure("scheduler_stalls"), 1.0);
  EXPECT_FALSE(bench.finds("scheduler does not call"));
  // A later caller still learns what it was.
  EXPECT_TRUE(eventually([&] {
    const std::string last = bench.device->report().last_fault;
    return last.starts_with("the vendor's scheduler did not call in time, ") &&
           last.find(" s ago: ") != std::string::npos;
  })) << bench.device->report().last_fault;
}

TEST(OpenHapticsScheduler, ADeadSchedulerDoesNotKeepARunFromStopping) {
  HdBench bench;
  ASSERT_TRUE(bench.renders(1.0));
  bench.page->kill_scheduler = true;
  EXPECT_TRUE(eventually([&] { return bench.finds("scheduler does not call"); }));
  bench.stop_running();
  EXPECT_FALSE(bench.page.device().force_enabled);
  EXPECT_EQ(bench.page.device().force_n[1], 0.0);  // in a frame from outside the scheduler
  bench.device->disengage();
  EXPECT_TRUE(bench.left_clean());
}

TEST(OpenHapticsScheduler, ADeadSchedulerIsGivenUpAndTheDeviceCanBeEngagedAgain) {
  HdBench bench([](OpenHapticsConfig& config) { config.death_s = 0.5; });
  ASSERT_TRUE(bench.renders(1.0));
  bench.page->kill_scheduler = true;
  EXPECT_TRUE(eventually([&] { return bench.returned.load(); }));
  bench.stop_running();
  EXPECT_TRUE(bench.finds("was abandoned"));
  EXPECT_EQ(bench.device->report().state, hal::PartState::kFaulty);
  EXPECT_FALSE(bench.page.device().force_enabled);

  bench.page->kill_scheduler = false;
  ASSERT_FALSE(bench.device->engage());
  EXPECT_EQ(bench.device->report().state, hal::PartState::kReady);
  bench.start_running();
  EXPECT_TRUE(bench.feels(1.0));
  EXPECT_TRUE(bench.leaves_clean());
}

TEST(OpenHapticsScheduler, StallingWhenAskedToStopItIsLeftWithTheForceOff) {
  HdBench bench;
  ASSERT_TRUE(bench.renders(1.0));
  bench.page->stall_ms = 1000;
  ASSERT_TRUE(eventually([&] { return bench.page->stall_ms == 0; }));
  bench.stop_running();
  EXPECT_FALSE(bench.page.device().force_enabled);
  EXPECT_EQ(bench.page.device().force_n[1], 0.0);
  bench.device->disengage();
  EXPECT_TRUE(bench.left_clean());
}

TEST(OpenHapticsScheduler, ReadingAndWritingTakesNoMemory) {
  HdBench bench;
  ASSERT_FALSE(bench.device->engage());
  class Counting final : public hal::ServoBody {
   public:
    explicit Counting(hal::HapticDevice& device) : device_(device) {}
    void on_servo() noexcept override {
      if (calls.load() == 200) before = allocations();
      hal::RigSample sample;
      device_.read(sample);
      device_.write({{0.1, 0.2, 100.0}});
      if (calls.load() == 1200) after = allocations();
      calls.fetch_add(1);
    }
    std::atomic<long> calls{0}, before{0}, after{-1};

   private:
    hal::HapticDevice& device_;
  } body(*bench.device);
  std::thread runner([&] { bench.device->run(body, bench.stop); });
  // Nothing else allocates meanwhile: neither this thread, nor the one that watches, nor the stand-in.
  while (body.calls.load() <= 1200 && !bench.returned) {
    timespec pause{0, 1'000'000};
    nanosleep(&pause, nullptr);
  }
  bench.stop = true;
  runner.join();
  EXPECT_EQ(body.after.load() - body.before.load(), 0);
}

}  // namespace
}  // namespace hapticd::test
