#include "rt/loop/virtual_time_runner.h"

#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <thread>

#include "tests/unit/rt/loop/fake_rig.h"

namespace hapticd::rt {
namespace {

// The loop waits for the observer, and the observer for the answer of the loop: neither for ever.
TEST(VirtualTimeRunner, AnObserverThatGivesACommandIsAnsweredAndLosesNothing) {
  constexpr std::uint64_t kTicks = 400;
  FakeRig rig(true);
  Engine engine(rig, 16);
  VirtualTimeRunner runner(engine);
  engine.observe(true);
  std::thread loop([&] {
    for (std::uint64_t i = 0; i < kTicks; ++i) rig.tick(runner);
  });
  std::thread telemetry([&] {  // so that nothing else is waited for
    TickRecord record;
    while (engine.last_tick() + 1 < kTicks) {
      if (!engine.pop_record(record)) std::this_thread::sleep_for(std::chrono::microseconds(50));
    }
  });
  Observation observation;
  std::uint64_t expected = 0;
  while (expected < kTicks) {
    if (!engine.pop_observation(observation)) continue;
    ASSERT_EQ(observation.sample.tick, expected++);
    if (expected % 100 != 50) continue;
    std::this_thread::sleep_for(std::chrono::milliseconds(30));  // the ring is full by now
    const EngineOutcome outcome = engine.execute({}, std::chrono::seconds(4));
    EXPECT_EQ(outcome.status, EngineOutcome::Status::kNoScene) << "answered, and not too late";
  }
  loop.join();
  telemetry.join();
}

TEST(VirtualTimeRunner, ASlowReaderLosesNothing) {
  FakeRig rig(true);
  Engine engine(rig, 16);
  VirtualTimeRunner runner(engine);
  std::atomic<bool> done{false};
  std::thread loop([&] {
    for (int i = 0; i < 500; ++i) rig.tick(runner);
    done = true;
  });
  TickRecord record;
  std::uint64_t expected = 0;
  while (expected < 500) {
    if (engine.pop_record(record)) {
      ASSERT_EQ(record.tick, expected++);
    } else {
      std::this_thread::yield();
    }
  }
  loop.join();
  EXPECT_EQ(engine.records_dropped(), 0U);
}

TEST(VirtualTimeRunner, AReaderThatNeverComesIsNotWaitedForTwice) {
  FakeRig rig(true);
  Engine engine(rig, 16);
  VirtualTimeRunner runner(engine);
  for (int i = 0; i < 500; ++i) rig.tick(runner);
  EXPECT_EQ(engine.last_tick(), 499U);
  EXPECT_EQ(engine.records_dropped(), 500U - 16U);
}

}  // namespace
}  // namespace hapticd::rt
