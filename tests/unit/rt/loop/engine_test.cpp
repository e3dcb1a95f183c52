#include "rt/loop/engine.h"

#include <gtest/gtest.h>

#include <atomic>
#include <cfloat>
#include <chrono>
#include <future>
#include <memory>
#include <thread>
#include <vector>

#include "fake_rig.h"
#include "rt/loop/flush_denormals.h"
#include "rt/scene/compose.h"

namespace hapticd::rt {
namespace {

using namespace std::chrono_literals;
using Status = EngineOutcome::Status;

/// Ticks an engine on a separate thread, as fast as it can, until it goes out of scope. That thread is also
/// the only one that drains the records, handing them to the test at the end.
class Ticking {
 public:
  Ticking(FakeRig& rig, Engine& engine)
      : thread_([this, &rig, &engine] {
          TickRecord record;
          while (!stop_.load()) {
            rig.write(rig.tick(engine));
            while (engine.pop_record(record)) {
            }
            std::this_thread::yield();
          }
        }) {}
  ~Ticking() {
    stop_.store(true);
    thread_.join();
  }

 private:
  std::atomic<bool> stop_{false};
  std::thread thread_;
};

std::unique_ptr<Pipeline> tap(const FakeRig& rig, SceneSpec& scene) {
  scene.name = "tap";
  scene = *resolve(scene, rig.info());
  return std::move(*compose(scene, rig.info()));
}

EngineCommand load(Pipeline* pipeline, const SceneSpec& scene) {
  EngineCommand command;
  command.kind = EngineCommand::Kind::kExchangeScene;
  command.pipeline = pipeline;
  command.guard = scene.guard;
  return command;
}

EngineCommand target(double stiffness, std::uint64_t at_tick = 0) {
  EngineCommand command;
  command.kind = EngineCommand::Kind::kSetTarget;
  command.target = linear_target(stiffness);
  command.ramp_s = 0.0;
  command.at_tick = at_tick;
  return command;
}

/// Wants a force that fades for ever, as filters do whose input went to zero.
class Fading final : public Pipeline {
 public:
  std::uint32_t channels() const noexcept override { return channel::kControl; }
  PipelineOutput evaluate(const hal::RigSample&) noexcept override {
    force_n_ *= 0.9;
    hand_n_ = 0.7 * force_n_;
    return {{0.0, -0.5 * force_n_, force_n_}, false, true, 0};
  }
  void fill_record(TickRecord& record) const noexcept override {
    record.commanded_force_n = force_n_;
    record.hand_force_n = hand_n_;
  }
  void applied(const hal::Vector3& force_n) noexcept override { applied_n = force_n.z; }
  void reset() noexcept override { force_n_ = 1.0; }
  void set_target(const TargetLaw&, double) noexcept override {}
  double applied_n = 1.0;

 private:
  double force_n_ = 1.0;
  double hand_n_ = 0.0;
};

TEST(Engine, NoDenormalNumberLeavesATickOrStaysInIt) {
  if (!FlushDenormals::works()) GTEST_SKIP() << "this processor cannot flush them";
  FakeRig rig;
  Engine engine(rig);
  Fading pipeline;
  SceneSpec scene;
  ASSERT_TRUE(tap(rig, scene));
  engine.preload(&pipeline, scene.guard);
  TickRecord record;
  // 0.9^n is denormal from n = 6724 on, and would stay at 5e-324 for good.
  for (int i = 0; i < 20'000; ++i) {
    const hal::DeviceCommand command = rig.tick(engine);
    ASSERT_TRUE(engine.pop_record(record));
    for (const double n : {command.force_n.y, command.force_n.z, record.commanded_force_n,
                           record.hand_force_n, pipeline.applied_n}) {
      ASSERT_NE(std::fpclassify(n), FP_SUBNORMAL) << "tick " << i;
    }
  }
  EXPECT_EQ(record.commanded_force_n, 0.0);
  EXPECT_EQ(pipeline.applied_n, 0.0);
  volatile double small = DBL_MIN;
  small = small / 4.0;
  EXPECT_NE(small, 0.0) << "the calling thread computes as it did before";
}

TEST(Engine, ACommandIsAcknowledgedWithItsTick) {
  FakeRig rig;
  Engine engine(rig);
  SceneSpec scene;
  const std::unique_ptr<Pipeline> pipeline = tap(rig, scene);
  EngineOutcome loaded;
  {
    const Ticking ticking(rig, engine);
    EXPECT_EQ(engine.execute(target(0.4), 10s).status, Status::kNoScene);
    loaded = engine.execute(load(pipeline.get(), scene), 10s);
    EXPECT_EQ(loaded.status, Status::kApplied);
    EXPECT_EQ(loaded.retired, nullptr);
    const EngineOutcome set = engine.execute(target(0.4), 10s);
    EXPECT_EQ(set.status, Status::kApplied);
    EXPECT_GT(set.tick, loaded.tick);
    EXPECT_EQ(set.time_ns, static_cast<std::int64_t>(set.tick) * 1'000'000);
  }
  // The tick that acknowledged is the tick that has it.
  TickRecord record;
  rig.tick(engine);
  ASSERT_TRUE(engine.pop_record(record));
  EXPECT_EQ(record.target_stiffness_n_per_mm, 0.4);
  EXPECT_EQ(record.scene_generation, 1U);
}

TEST(Engine, AScheduledCommandTakesEffectAtItsTickAndNotBefore) {
  FakeRig rig;
  Engine engine(rig);
  SceneSpec scene;
  const std::unique_ptr<Pipeline> pipeline = tap(rig, scene);
  const Ticking ticking(rig, engine);
  engine.execute(load(pipeline.get(), scene), 10s);
  const std::uint64_t due = engine.last_tick() + 5000;
  const EngineOutcome outcome = engine.execute(target(0.9, due), 60s);
  EXPECT_EQ(outcome.status, Status::kApplied);
  EXPECT_EQ(outcome.tick, due);
}

TEST(Engine, ExchangeHandsBackTheOneBefore) {
  FakeRig rig;
  Engine engine(rig);
  SceneSpec scene;
  const std::unique_ptr<Pipeline> first = tap(rig, scene);
  const std::unique_ptr<Pipeline> second = tap(rig, scene);
  const Ticking ticking(rig, engine);
  engine.execute(load(first.get(), scene), 10s);
  EXPECT_EQ(engine.execute(load(second.get(), scene), 10s).retired, first.get());
  EXPECT_EQ(engine.execute(load(nullptr, scene), 10s).retired, second.get());
}

TEST(Engine, ATimedOutCommandIsWithdrawnForGood) {
  FakeRig rig;
  Engine engine(rig);
  SceneSpec scene;
  const std::unique_ptr<Pipeline> pipeline = tap(rig, scene);
  EXPECT_EQ(engine.execute(load(pipeline.get(), scene), 1ms).status, Status::kTimedOut) << "no one ticks";
  TickRecord record;
  for (int i = 0; i < 10; ++i) rig.tick(engine);
  while (engine.pop_record(record)) EXPECT_EQ(record.scene_generation, 0U);
}

TEST(Engine, RefusesWhenTooManyCommandsWaitAndRecovers) {
  FakeRig rig;
  Engine engine(rig);
  for (std::size_t i = 0; i < Engine::kCommandSlots; ++i) {
    EXPECT_EQ(engine.execute(target(0.5), 0ns).status, Status::kTimedOut);
  }
  EXPECT_EQ(engine.execute(target(0.5), 0ns).status, Status::kQueueFull);
  rig.tick(engine);  // meets the withdrawn ones and frees their slots
  EXPECT_EQ(engine.execute(target(0.5), 0ns).status, Status::kTimedOut);
}

TEST(Engine, StopLatchesAtTheNextTickAndClearReleases) {
  FakeRig rig;
  Engine engine(rig);
  TickRecord record;
  engine.stop();
  rig.tick(engine);
  ASSERT_TRUE(engine.pop_record(record));
  EXPECT_EQ(record.guard_state, GuardState::kLatched);
  EXPECT_EQ(record.guard_fault, GuardFault::kStopped);
  const Ticking ticking(rig, engine);
  EngineCommand clear;
  clear.kind = EngineCommand::Kind::kClear;
  EXPECT_EQ(engine.execute(clear, 10s).status, Status::kApplied);
}

TEST(Engine, AClearThatMeetsAStopInItsTickIsRefused) {
  FakeRig rig;
  Engine engine(rig);
  EngineCommand clear;
  clear.kind = EngineCommand::Kind::kClear;
  auto cleared = std::async(std::launch::async, [&] { return engine.execute(clear, 10s).status; });
  do {  // whichever tick takes the clear up, a stop is waiting
    engine.stop();
    rig.tick(engine);
  } while (cleared.wait_for(1ms) != std::future_status::ready);
  EXPECT_EQ(cleared.get(), Status::kFaultPersists);
}

TEST(Engine, LostRecordsAreCountedAndLeaveAGapInTheSequence) {
  FakeRig rig;
  Engine engine(rig, 16);
  for (int i = 0; i < 26; ++i) rig.tick(engine);
  EXPECT_EQ(engine.records_dropped(), 10U);
  TickRecord record;
  std::uint64_t last = 0;
  while (engine.pop_record(record)) last = record.tick;
  EXPECT_EQ(last, 15U);
}

TEST(Engine, HandsOnWhatItMeasuredOnlyWhileObserved) {
  FakeRig rig;
  Engine engine(rig, 16);
  const auto ticks = [&](int count) {
    for (int i = 0; i < count; ++i) rig.tick(engine);
  };
  Observation observation;
  ticks(3);
  EXPECT_FALSE(engine.pop_observation(observation));
  engine.observe(true);
  ticks(2);
  ASSERT_TRUE(engine.pop_observation(observation));
  EXPECT_EQ(observation.sample.tick, 3U);
  EXPECT_EQ(observation.sample.force_count, 10U);
  EXPECT_FALSE(observation.has_external_position);
  engine.observe(false);
  ticks(2);
  engine.observe(true);  // what was left from before is not the present
  ticks(1);
  ASSERT_TRUE(engine.pop_observation(observation));
  EXPECT_EQ(observation.sample.tick, 7U);
  ticks(20);  // more than there is room for: a gap in the ticks, and no wait
  std::uint64_t last = 0;
  while (engine.pop_observation(observation)) last = observation.sample.tick;
  EXPECT_EQ(last, 23U);
}

TEST(Engine, ManyCallersAtOnceEachGetTheirOwnAnswer) {
  FakeRig rig;
  Engine engine(rig);
  SceneSpec scene;
  const std::unique_ptr<Pipeline> pipeline = tap(rig, scene);
  std::atomic<int> applied{0};
  {
    const Ticking ticking(rig, engine);
    engine.execute(load(pipeline.get(), scene), 10s);
    std::vector<std::thread> callers;
    for (int caller = 0; caller < 8; ++caller) {
      callers.emplace_back([&engine, &applied] {
        for (int i = 0; i < 50; ++i) {
          if (engine.execute(target(0.1 + 0.001 * i), 30s).status == Status::kApplied) ++applied;
          if (i % 10 == 0) engine.stop();
        }
      });
    }
    for (std::thread& caller : callers) caller.join();
  }
  EXPECT_EQ(applied.load(), 400);
}

}  // namespace
}  // namespace hapticd::rt
