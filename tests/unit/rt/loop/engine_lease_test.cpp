// What was admitted under another state of control takes no effect.

#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <memory>
#include <thread>

#include "fake_rig.h"
#include "rt/loop/engine.h"
#include "rt/scene/compose.h"

namespace hapticd::rt {
namespace {

using namespace std::chrono_literals;
using Status = EngineOutcome::Status;

/// An engine with a scene, whose ticks the test calls itself.
struct Bench {
  Bench() {
    scene.name = "tap";
    scene = *resolve(scene, rig.info());
    pipeline = std::move(*compose(scene, rig.info()));
    engine.preload(pipeline.get(), scene.guard);
  }
  void tick() {
    rig.tick(engine);
    TickRecord record;
    engine.pop_record(record);
  }
  /// Ticks until the command was answered.
  EngineOutcome execute(const EngineCommand& command) {
    EngineOutcome outcome;
    std::atomic<bool> answered{false};
    std::thread caller([&] {
      outcome = engine.execute(command, 60s);
      answered = true;
    });
    while (!answered) {
      tick();
      std::this_thread::yield();
    }
    caller.join();
    return outcome;
  }

  FakeRig rig;
  Engine engine{rig};
  SceneSpec scene;
  std::unique_ptr<Pipeline> pipeline;
};

EngineCommand under(std::uint64_t lease) {
  EngineCommand command;
  command.kind = EngineCommand::Kind::kSetTarget;
  command.target = linear_target(0.5);
  command.lease = lease;
  return command;
}

TEST(EngineLease, OnlyThePresentNumberCommandsAndLaterOnes) {
  Bench bench;
  bench.engine.set_lease(7);
  EXPECT_EQ(bench.execute(under(7)).status, Status::kApplied);
  EXPECT_EQ(bench.execute(under(6)).status, Status::kLeaseLost);
  EXPECT_EQ(bench.execute(under(8)).status, Status::kApplied) << "the loop learns of that change in a moment";
  EXPECT_EQ(bench.execute(under(0)).status, Status::kApplied) << "the daemon's own";
}

TEST(EngineLease, ChangesThatArriveInAnotherOrderLeaveTheLastOneInForce) {
  Bench bench;
  bench.engine.set_lease(7);
  bench.engine.set_lease(6);
  EXPECT_EQ(bench.execute(under(6)).status, Status::kLeaseLost);
  EXPECT_EQ(bench.execute(under(7)).status, Status::kApplied);
}

TEST(EngineLease, EveryKindOfCommandIsCompared) {
  Bench bench;
  bench.engine.set_lease(2);
  for (const auto kind :
       {EngineCommand::Kind::kSetTarget, EngineCommand::Kind::kExchangeScene, EngineCommand::Kind::kClear}) {
    EngineCommand command = under(1);
    command.kind = kind;
    const EngineOutcome outcome = bench.execute(command);
    EXPECT_EQ(outcome.status, Status::kLeaseLost);
    EXPECT_EQ(outcome.retired, nullptr);
  }
  EXPECT_EQ(bench.execute(under(2)).status, Status::kApplied) << "the scene is still there";
}

TEST(EngineLease, WhatWaitsForItsTimeIsAnsweredOnceControlChanges) {
  Bench bench;
  bench.engine.set_lease(1);
  EngineCommand later = under(1);
  later.at_tick = UINT64_MAX;  // else it would wait for ever
  EngineOutcome outcome;
  std::atomic<bool> answered{false};
  std::thread caller([&] {
    outcome = bench.engine.execute(later, 60s);
    answered = true;
  });
  for (int i = 0; i < 1000 && !answered; ++i) {
    bench.tick();
    std::this_thread::sleep_for(50us);
  }
  EXPECT_FALSE(answered);
  bench.engine.set_lease(2);
  while (!answered) {
    bench.tick();
    std::this_thread::yield();
  }
  caller.join();
  EXPECT_EQ(outcome.status, Status::kLeaseLost);
}

/// Two threads that only meet at the number: no command of the old holder at the second tick after the change
/// or later, whichever is faster.
TEST(EngineLease, NoRaceLetsAnOldCommandThrough) {
  Bench bench;
  std::atomic<bool> over{false};
  std::thread loop([&] {
    while (!over) {
      bench.tick();
      std::this_thread::yield();
    }
  });
  int applied = 0;
  int lost = 0;
  for (std::uint64_t number = 1; number <= 2000; ++number) {
    bench.engine.set_lease(number);
    std::atomic<bool> began{false};
    EngineOutcome outcome;
    std::thread holder([&] {
      began = true;
      outcome = bench.engine.execute(under(number), 60s);
    });
    while (!began) std::this_thread::yield();
    if (number % 2 == 0) std::this_thread::sleep_for(50us);  // so that both outcomes occur
    bench.engine.set_lease(number + 1);
    const std::uint64_t last_tick = bench.engine.last_tick();
    holder.join();
    if (outcome.status == Status::kApplied) {
      ++applied;
      EXPECT_LE(outcome.tick, last_tick + 1);
    } else {
      EXPECT_EQ(outcome.status, Status::kLeaseLost);
      ++lost;
    }
  }
  over = true;
  loop.join();
  EXPECT_GT(lost, 0);
  EXPECT_GT(applied, 0);
}

}  // namespace
}  // namespace hapticd::rt
