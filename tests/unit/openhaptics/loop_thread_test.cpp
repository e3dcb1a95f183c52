#include <gtest/gtest.h>
#include <sched.h>
#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <string>
#include <thread>
#include <vector>

#include "hal/composed_rig.h"
#include "hd_bench.h"
#include "rt/loop/engine.h"
#include "rt/loop/loop_cpu.h"
#include "rt/loop/periodic_loop.h"
#include "rt/loop/thread_schedule.h"

namespace hapticd::test {
namespace {

constexpr int kPriority = 7;

bool may_have_priority() {
  bool granted = false;
  std::thread([&] { granted = rt::take_schedule(-1, kPriority).priority == 0; }).join();
  return granted;
}

std::vector<pid_t> threads_of_process() {
  std::vector<pid_t> threads;
  for (const auto& entry : std::filesystem::directory_iterator("/proc/self/task"))
    threads.push_back(std::stoi(entry.path().filename().string()));
  return threads;
}

/// Gives this thread back the CPUs that it had.
class KeptCpus {
 public:
  KeptCpus() { sched_getaffinity(0, sizeof set_, &set_); }
  ~KeptCpus() { sched_setaffinity(0, sizeof set_, &set_); }
  KeptCpus(const KeptCpus&) = delete;
  KeptCpus& operator=(const KeptCpus&) = delete;

 private:
  cpu_set_t set_{};
};

/// A device whose scheduler ticks, under the daemon's loop with a separate priority and CPU.
class TickingScheduler {
 public:
  explicit TickingScheduler(int cpu) : rig(parts_with(std::move(bench.device)), 1000.0), engine(rig) {
    config.fifo_priority = kPriority;
    config.cpu = cpu;
    config.lock_memory = false;
    config.keep_cpu_awake = false;
    loop = std::make_unique<rt::PeriodicLoop>(rig, engine, config);
  }
  bool ticks() {
    const std::uint64_t before = loop->statistics().ticks;
    return eventually([&] { return loop->statistics().ticks >= before + 20; });
  }
  void expect_only_the_ticking_thread_has_it() {
    const pid_t ticking = loop->ticking_thread();
    const auto schedule = rt::schedule_of(ticking);
    ASSERT_TRUE(schedule);
    EXPECT_EQ(schedule->fifo_priority, kPriority);
    EXPECT_EQ(schedule->cpus, std::vector<int>{config.cpu});
    EXPECT_TRUE(loop->shortcomings().empty()) << loop->shortcomings().front();
    int others = 0;
    for (const pid_t thread : threads_of_process()) {
      const auto other = rt::schedule_of(thread);
      const bool was_before = std::count(earlier.begin(), earlier.end(), thread) > 0;  // a sanitizer's own
      if (thread == ticking || !other || (was_before && thread != getpid())) continue;
      ++others;
      EXPECT_EQ(other->fifo_priority, 0) << thread;
      EXPECT_EQ(std::count(other->cpus.begin(), other->cpus.end(), config.cpu), 0) << thread;
    }
    EXPECT_GE(others, 3) << "the test's, the loop's and the one that calls the vendor's library";
  }

  const std::vector<pid_t> earlier = threads_of_process();
  HdBench bench{[](OpenHapticsConfig& c) { c.death_s = 0.5; }};
  hal::ComposedRig rig;
  rt::Engine engine;
  rt::LoopConfig config;
  std::unique_ptr<rt::PeriodicLoop> loop;

 private:
  static hal::RigParts parts_with(std::unique_ptr<hal::HapticDevice> device) {
    hal::RigParts parts;
    parts.device = std::move(device);
    return parts;
  }
};

TEST(OpenHapticsLoop, TheThreadThatTicksHasTheLoopsPriorityAndCpuAlsoAfterAReEngagement) {
  const KeptCpus kept;
  const int cpu = rt::schedule_of(0)->cpus.back();
  if (!may_have_priority())
    GTEST_SKIP() << "this user may not have SCHED_FIFO: run it as root, or ulimit -r 99";
  if (rt::schedule_of(0)->cpus.size() < 2)
    GTEST_SKIP() << "there is one CPU only: none can be kept for the loop";
  ASSERT_EQ(rt::leave_to_the_loop(cpu), "");

  TickingScheduler scheduler(cpu);
  ASSERT_FALSE(scheduler.rig.engage(hal::RigPartKind::kDevice));
  scheduler.loop->start();
  ASSERT_TRUE(scheduler.ticks());
  scheduler.expect_only_the_ticking_thread_has_it();

  scheduler.bench.page->kill_scheduler = true;
  ASSERT_TRUE(eventually([&] { return scheduler.loop->clock_losses() > 0; }));
  scheduler.bench.page->kill_scheduler = false;
  ASSERT_TRUE(scheduler.ticks()) << "it is engaged again";
  scheduler.expect_only_the_ticking_thread_has_it();
  scheduler.loop->stop();
}

TEST(OpenHapticsLoop, WhatTheTickingThreadLacksIsReported) {
  TickingScheduler scheduler(0);
  scheduler.config.cpu = CPU_SETSIZE - 1;  // there is no such CPU
  scheduler.config.fifo_priority = 0;
  rt::PeriodicLoop loop(scheduler.rig, scheduler.engine, scheduler.config);
  EXPECT_EQ(loop.ticking_thread(), 0);
  ASSERT_FALSE(scheduler.rig.engage(hal::RigPartKind::kDevice));
  loop.start();
  ASSERT_TRUE(eventually([&] { return loop.ticking_thread() != 0; }));
  ASSERT_EQ(loop.shortcomings().size(), 1U);
  EXPECT_NE(loop.shortcomings().front().find("not pinned to CPU"), std::string::npos);
  loop.stop();
}

}  // namespace
}  // namespace hapticd::test
