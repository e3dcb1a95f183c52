#include <dlfcn.h>
#include <gtest/gtest.h>
#include <pthread.h>

#include <atomic>
#include <chrono>
#include <cmath>
#include <new>
#include <thread>

#include "explore_bench.h"
#include "rt/loop/engine.h"
#include "rt/scene/compose.h"
#include "rt/scene/corrected_pipeline.h"
#include "tests/unit/allocation_counter.h"
#include "tests/unit/rt/loop/fake_rig.h"

// Locks taken while `watched` is set on the calling thread are counted.
namespace {
thread_local bool watched = false;
std::atomic<int> locks{0};
}  // namespace

extern "C" int pthread_mutex_lock(pthread_mutex_t* mutex) noexcept {
  using Lock = int (*)(pthread_mutex_t*);
  static const auto real = reinterpret_cast<Lock>(dlsym(RTLD_NEXT, "pthread_mutex_lock"));
  if (watched) ++locks;
  return real(mutex);
}

namespace hapticd::rt {
namespace {

TEST(Tick, TheCountersCount) {
  const long before = hapticd::test::allocations();
  locks = 0;
  ::operator delete(::operator new(8));  // called by name: a new-expression may be optimised away
  const long after = hapticd::test::allocations();
  watched = true;
  pthread_mutex_t mutex = PTHREAD_MUTEX_INITIALIZER;
  pthread_mutex_lock(&mutex);
  watched = false;
  pthread_mutex_unlock(&mutex);
  EXPECT_EQ(after - before, 1);
  EXPECT_EQ(locks, 1);
}

/// Taps, faults, clears, target changes and scene changes, all through the engine's tick.
TEST(Tick, NeitherAllocatesNorLocks) {
  FakeRig rig;
  Engine engine(rig, 256);
  SceneSpec tap;
  tap.name = "tap";
  tap = *resolve(tap, rig.info());
  SceneSpec wall;
  wall.name = "wall";
  wall.kind = SceneKind::kWall;
  wall = *resolve(wall, rig.info());
  const auto tap_pipeline = std::move(*compose(tap, rig.info()));
  const auto wall_pipeline = std::move(*compose(wall, rig.info()));

  std::atomic<bool> done{false};
  std::thread caller([&] {
    using namespace std::chrono_literals;
    for (int i = 0; i < 50; ++i) {
      EngineCommand command;
      command.kind = EngineCommand::Kind::kExchangeScene;
      command.pipeline = i % 2 == 0 ? tap_pipeline.get() : wall_pipeline.get();
      command.guard = i % 2 == 0 ? tap.guard : wall.guard;
      engine.execute(command, 30s);
      command.kind = EngineCommand::Kind::kSetTarget;
      command.target = linear_target(0.1 * (i % 7));
      command.ramp_s = 0.01;
      engine.execute(command, 30s);
      engine.stop();
      command.kind = EngineCommand::Kind::kClear;
      engine.execute(command, 30s);
    }
    done = true;
  });

  locks = 0;
  long allocations = 0;
  TickRecord record;
  std::uint64_t contacts = 0;
  for (std::uint64_t i = 0; i < 20000 || !done; ++i) {
    hal::RigSample sample;
    sample.tick = i;
    sample.time_ns = static_cast<std::int64_t>(i) * 1'000'000;
    const double depth = 4.0 * std::sin(0.005 * static_cast<double>(i));
    sample.tip_position_mm.z = -depth;
    sample.sensor_force_n.z = 0.4 * std::max(0.0, depth);
    if (i % 5000 == 4999) sample.sensor_force_n.x = std::nan("");
    const long before = hapticd::test::allocations();
    watched = true;
    engine.on_tick(sample);
    watched = false;
    allocations += hapticd::test::allocations() - before;
    while (engine.pop_record(record)) contacts = std::max<std::uint64_t>(contacts, record.contact_count);
    std::this_thread::yield();
  }
  caller.join();
  EXPECT_EQ(allocations, 0);
  EXPECT_EQ(locks, 0);
  EXPECT_GT(contacts, 0U) << "the ticks went through contact, or this proves little";
}

/// Contacts that begin, slide and end, switches to every kind of target in and out of contact, faults, stops
/// and clears, in every composition of an explore scene.
TEST(Tick, OfAnExploreSceneNeitherAllocatesNorLocks) {
  std::vector<SceneSpec> scenes = test::all_explore_scenes();
  scenes.push_back(scenes.front());
  scenes.back().name = "inclusion";
  InclusionParameters& inclusion = scenes.back().inclusions.emplace_back();
  inclusion.place_mm = {0.0, 0.0, -25.0};
  inclusion.response = {0.018, 5e-5, 2.4};
  std::array<TargetLaw, 4> targets;
  for (std::size_t i = 0; i < targets.size(); ++i) {
    targets[i].kind = static_cast<TargetLaw::Kind>(i);
    targets[i].hunt_crossley = {0.2, 1e-3, 1.5};
    targets[i].knots[0] = {0.0, 0.2};
    targets[i].knots[1] = {3.0, 0.9};
    targets[i].knot_count = 2;
    ASSERT_FALSE(check(targets[i], "test"));
  }
  // Every scene with both laws of friction.
  for (std::size_t run = 0; run < 2 * scenes.size(); ++run) {
    const SceneSpec& spec = scenes[run / 2];
    test::ExploreBench bench(spec, run % 2 == 0 ? test::bench_model() : test::maxwell_slip_model());
    bench.rest({0.0, 0.0, 10.0}, 100);
    locks = 0;
    long allocations = 0;
    int began = 0, ended = 0, switched = 0, latched = 0;
    bool in_contact = false;
    for (int i = 0; i < 20'000; ++i) {
      const double t = 1e-3 * i;
      hal::RigSample sample =
          bench.at({8.0 * std::sin(2.0 * t), 5.0 * std::sin(1.3 * t), 1.0 - 4.0 * std::sin(5.0 * t)});
      if (i % 7000 == 6999) sample.sensor_force_n.x = std::nan("");
      const long before = hapticd::test::allocations();
      watched = true;
      if (i % 211 == 0) bench.renderer().set_target(targets[static_cast<std::size_t>(i / 211) % 4], 0.1);
      if (i % 5000 == 4999) bench.renderer().raise(GuardFault::kStopped);
      if (i % 500 == 0) bench.renderer().clear();
      const TickRecord record = bench.tick(sample);
      watched = false;
      allocations += hapticd::test::allocations() - before;
      if (record.in_contact && !in_contact) ++began;
      if (!record.in_contact && in_contact) ++ended;
      in_contact = record.in_contact;
      if (i % 211 == 0 && in_contact) ++switched;
      if (record.guard_state == GuardState::kLatched) ++latched;
    }
    EXPECT_EQ(allocations, 0) << spec.name;
    EXPECT_EQ(locks, 0) << spec.name;
    EXPECT_GT(began, 5) << spec.name << ": or this proves little";
    EXPECT_GT(ended, 5) << spec.name;
    EXPECT_GT(switched, 5) << spec.name;
    EXPECT_GT(latched, 5) << spec.name;
  }
}

/// A scene on corrected poses, with angles and without, in contact and free.
TEST(Tick, OnCorrectedPosesNeitherAllocatesNorLocks) {
  test::ExploreBench bench(test::explore_scene(Tip::kRod));
  ArmCorrection correction;
  for (ArmModel* arm : {&correction.nominal, &correction.arm}) {
    arm->use = AngleUse::kPosition;
    arm->first_link_mm = arm->second_link_mm = 140.0;
    arm->rig_from_base.translation_mm = {-140.0, 0.0, 140.0};
  }
  correction.arm.joint_offset_rad[1] = 1e-3;
  const ObjectModel model = test::bench_model();
  CorrectedPipeline pipeline(std::move(*compose(bench.scene(), bench.info(), &model)), correction);
  locks = 0;
  long allocations = 0;
  int touched = 0;
  int corrected = 0;
  for (int i = 0; i < 10'000; ++i) {
    hal::RigSample sample = bench.at({0.0, 0.0, 1.0 - 4.0 * std::sin(5e-3 * i)});
    sample.time_ns = 1'000'000LL * i;
    sample.angles = {.joint_rad = {0.0, 1e-4 * i, 0.0}, .gimbal_rad = {}, .known = i % 3 != 0};
    TickRecord record;
    const long before = hapticd::test::allocations();
    watched = true;
    const PipelineOutput output = pipeline.evaluate(sample);
    pipeline.fill_record(record);
    pipeline.applied(output.force_n);
    watched = false;
    allocations += hapticd::test::allocations() - before;
    touched += output.in_contact ? 1 : 0;
    corrected += correct(correction, sample).source == PoseSource::kJointAngles ? 1 : 0;
  }
  EXPECT_EQ(allocations, 0);
  EXPECT_EQ(locks, 0);
  EXPECT_GT(touched, 0) << "or this proves little";
  EXPECT_GT(corrected, 5000);
}

TickRecord absurd_record() {
  TickRecord record;
  record.channels = ~0U;
  record.tick = 1ULL << 40U;
  record.tip_position_mm = record.zero.force_n = record.jump_n = record.normal = {1e3, -1e3, 1e3};
  record.in_contact = true;
  record.contact_reason = ContactReason::kWithdrawn;
  record.contact_authority = record.reaction_force_n = record.displacement_mm = 1e3;
  record.hand_force_n = record.desired_force_n = record.commanded_force_n = record.hand_energy_mj = -1e3;
  record.guard_state = GuardState::kLatched;
  record.guard_limits = 0xFF;
  record.guide_state = GuideState::kContact;
  return record;
}

/// A scene with a fixture and a watch, pressed and stroked, with a jump of the reading, an unfit sample and a
/// stop.
struct Watched {
  std::vector<hal::Vector3> commands_n;
  PresentationSummary summary;
};
Watched watched_scene(const SceneSpec& spec, const TickRecord& before) {
  test::ExploreBench bench(spec);
  AssistanceSpec assistance;
  assistance.fixture.emplace();
  assistance.watch.emplace();
  bench.renderer().exchange(&bench.pipeline(), bench.scene().guard, assistance);
  bench.renderer().assistance().begin_presentation();
  Watched seen;
  for (int i = 0; i < 6000; ++i) {
    const double t = 1e-3 * i;
    hal::RigSample sample = bench.at({8.0 * std::sin(2.0 * t), 0.0, 1.0 - 4.0 * std::sin(5.0 * t)});
    sample.tick = static_cast<std::uint64_t>(i);
    sample.time_ns = 1'000'000LL * i;
    if (i >= 2000) sample.sensor_force_n.y += 0.5;
    if (i == 3000) sample.sensor_force_n.x = std::nan("");
    if (i == 4000) bench.renderer().raise(GuardFault::kStopped);
    if (i % 500 == 0) bench.renderer().clear();
    TickRecord record = before;
    seen.commands_n.push_back(bench.renderer().tick(sample, record).force_n);
  }
  seen.summary = bench.renderer().assistance().end_presentation();
  return seen;
}

TEST(Tick, DoesTheSameWhateverARecordHolds) {
  std::vector<SceneSpec> scenes = test::all_explore_scenes();
  for (const SceneKind kind : {SceneKind::kTap1d, SceneKind::kWall}) {
    SceneSpec& scene = scenes.emplace_back();
    scene.name = kind == SceneKind::kWall ? "wall" : "tap";
    scene.kind = kind;
  }
  for (const SceneSpec& scene : scenes) {
    const Watched empty = watched_scene(scene, {});
    const Watched absurd = watched_scene(scene, absurd_record());
    double largest_n = 0.0;
    double difference_n = 0.0;
    for (std::size_t i = 0; i < empty.commands_n.size(); ++i) {
      largest_n = std::max(largest_n, norm(empty.commands_n[i]));
      difference_n = std::max(difference_n, norm(absurd.commands_n[i] - empty.commands_n[i]));
    }
    EXPECT_EQ(difference_n, 0.0) << scene.name;
    EXPECT_GT(largest_n, 0.1) << scene.name << ": or this proves little";
    EXPECT_GT(empty.summary.contacts, 0U) << scene.name;
    EXPECT_EQ(absurd.summary.contacts, empty.summary.contacts) << scene.name;
    EXPECT_EQ(absurd.summary.begin_tick, empty.summary.begin_tick) << scene.name;
    EXPECT_EQ(absurd.summary.peak_force_n, empty.summary.peak_force_n) << scene.name;
    EXPECT_EQ(absurd.summary.peak_displacement_mm, empty.summary.peak_displacement_mm) << scene.name;
    EXPECT_EQ(absurd.summary.peak_lateral_mm, empty.summary.peak_lateral_mm) << scene.name;
    EXPECT_EQ(absurd.summary.guard_limited_ticks, empty.summary.guard_limited_ticks) << scene.name;
    EXPECT_EQ(absurd.summary.broken, empty.summary.broken) << scene.name;
  }
}

}  // namespace
}  // namespace hapticd::rt
