#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "tests/measure/study/common/virtual_run.h"

namespace hapticd::study {
namespace {

using rt::GuideState;

/// How fast the table of the "lab" shakes the tip, at most (conditions.h: 5 µm at 25 Hz and less above).
constexpr double kTableMmPerS = 1.0;

double length(const hal::Vector3& v) {
  return std::sqrt(dot(v, v));
}

rt::SceneSpec press_scene() {
  rt::SceneSpec spec;
  spec.name = "press";
  spec.target.stiffness_n_per_mm = 0.5;
  return spec;
}

sim::HandProgram following() {
  sim::HandProgram program;
  program.kind = sim::HandProgram::Kind::kFollow;
  return program;
}

struct Led {
  GuideState end = GuideState::kNone;
  double peak_mm_per_s = 0.0;   ///< true, over five ticks, until it lets go
  double largest_step_n = 0.0;  ///< of the guide's force, between ticks, while it lets go
  double error_mm = 0.0;
  double took_s = 0.0;
};

/// Leads the tool until the guide has let go.
Led lead(VirtualRun& rig, const rt::GuideMotion& motion) {
  Led led;
  rig.assistance().begin_guide(motion);
  hal::Vector3 last_n;
  struct Place {
    double time_s;
    hal::Vector3 tip_mm;
  };
  std::vector<Place> path;
  double time_s = 0.0;
  const std::int64_t began_ns = rig.record().time_ns;
  for (bool ended = false; time_s < motion.timeout_s + 1.0;) {
    rig.step();
    time_s = 1e-9 * static_cast<double>(rig.record().time_ns - began_ns);
    path.push_back({time_s, rig.truth().tip_position_mm});
    if (!ended && path.size() > 5) {
      const Place& before = path[path.size() - 6];
      const double mm = length(path.back().tip_mm - before.tip_mm);
      led.peak_mm_per_s = std::max(led.peak_mm_per_s, mm / (time_s - before.time_s));
    }
    const hal::Vector3 force_n = rig.record().guide_force_n;
    if (ended) led.largest_step_n = std::max(led.largest_step_n, length(force_n - last_n));
    last_n = force_n;
    if (!ended && rig.record().guide_state != GuideState::kUnderWay) {
      ended = true;
      led.took_s = time_s;
      led.error_mm = length(rig.truth().tip_position_mm - motion.goal_mm);
    }
    if (ended && time_s > led.took_s + 0.3) break;
  }
  led.end = rig.record().guide_state;
  return led;
}

TEST(ToolGuide, LeadsAFollowingHandNoFasterThanItIsTold) {
  for (const char* device : {"phantom_1_0", "phantom_1_5_high_force"}) {
    sim::SimulationConfig config;
    config.device = device;
    config.object = "none";
    VirtualRun rig(config, press_scene());
    rig.set_hand(following());
    rig.run(0.5);
    const Led led = lead(rig, {.goal_mm = {20.0, -10.0, 45.0}});
    EXPECT_EQ(led.end, GuideState::kArrived) << device;
    EXPECT_LE(led.peak_mm_per_s, 15.0 * 1.05) << device;
    EXPECT_LE(led.largest_step_n, 0.05) << device;
    EXPECT_LE(led.error_mm, 1.0) << device;
  }
}

TEST(ToolGuide, LeadsAnArmThatNobodyHoldsOnAShakyTableWithALateClock) {
  sim::SimulationConfig config;
  config.object = "none";
  config.conditions = "lab";
  VirtualRun rig(config, press_scene());
  rig.set_hand({.kind = sim::HandProgram::Kind::kShake, .force_n = 0.0});  // a light spring, no hand
  rig.run(0.5);
  const Led led = lead(rig, {.goal_mm = {5.0, -5.0, 35.0}});
  EXPECT_EQ(led.end, GuideState::kArrived);
  EXPECT_LE(led.peak_mm_per_s, 15.0 * 1.05 + kTableMmPerS);
  EXPECT_LE(led.largest_step_n, 0.05);
}

TEST(ToolGuide, StopsWhereAnObjectIsTouched) {
  for (const char* object : {"sponge_block", "rubber_ball"}) {
    sim::SimulationConfig config;
    config.object = object;
    VirtualRun rig(config, press_scene());
    rig.set_hand(following());
    rig.run(0.5);
    const Led led = lead(rig, {.goal_mm = {0.0, 0.0, -20.0}});
    EXPECT_EQ(led.end, GuideState::kContact) << object;
    EXPECT_LE(led.peak_mm_per_s, 15.0 * 1.05) << object;
    EXPECT_LE(led.largest_step_n, 0.05) << object;
    EXPECT_GT(rig.truth().tip_position_mm.z, -3.0) << object;
  }
}

TEST(ToolGuide, GivesInToAHandThatHoldsFast) {
  sim::SimulationConfig config;
  config.object = "none";
  VirtualRun rig(config, press_scene());
  sim::HandProgram still;
  still.kind = sim::HandProgram::Kind::kRest;
  rig.set_hand(still);
  rig.run(1.0);
  const Led led = lead(rig, {.goal_mm = {0.0, 0.0, -60.0}, .max_force_n = 1.0});
  EXPECT_EQ(led.end, GuideState::kResisted);
  EXPECT_LE(led.largest_step_n, 0.05);
}

TEST(ToolGuide, EndsWhereTheGuardTakesTheForceAwayAndDoesNotGoOn) {
  sim::SimulationConfig config;
  config.object = "none";
  VirtualRun rig(config, press_scene());
  rig.set_hand(following());
  rig.run(0.5);
  rig.assistance().begin_guide({.goal_mm = {30.0, 0.0, 25.0}});
  rig.run(1.0);
  ASSERT_GT(length(rig.record().guide_force_n), 0.01);
  rig.renderer().raise(rt::GuardFault::kStopped);
  rig.step();
  EXPECT_EQ(length(rig.record().device_command_n), 0.0);
  rig.step();
  EXPECT_EQ(rig.record().guide_state, GuideState::kForceCut);
  rig.run(0.1);
  ASSERT_TRUE(rig.renderer().clear());
  rig.run(1.0);
  EXPECT_EQ(length(rig.record().guide_force_n), 0.0);
  EXPECT_EQ(rig.record().guide_state, GuideState::kForceCut);
}

TEST(ToolGuide, ACancelledOneLetsGoWithoutAJerk) {
  sim::SimulationConfig config;
  config.object = "none";
  VirtualRun rig(config, press_scene());
  rig.set_hand(following());
  rig.run(0.5);
  rig.assistance().begin_guide({.goal_mm = {30.0, 0.0, 25.0}});
  rig.run(1.0);
  rig.assistance().cancel_guide();
  hal::Vector3 last_n = rig.record().guide_force_n;
  double largest_n = 0.0;
  rig.run(0.4, [&] {
    largest_n = std::max(largest_n, length(rig.record().guide_force_n - last_n));
    last_n = rig.record().guide_force_n;
  });
  EXPECT_LE(largest_n, 0.05);
  EXPECT_EQ(length(last_n), 0.0);
  EXPECT_EQ(rig.record().guide_state, GuideState::kCancelled);
}

/// Stiffness at the hand along the press, over a press to 3 N, with a fixture and without.
struct Pressed {
  std::vector<double> hand_n;
  double fixture_along_n = 0.0;  ///< the largest that the fixture itself asks for
  double lateral_mm = 0.0;
};

Pressed pressed(bool fixture, double aside_mm) {
  rt::SceneSpec spec = press_scene();
  if (fixture) spec.fixture.emplace();
  VirtualRun rig({}, spec);
  sim::HandProgram press{.kind = sim::HandProgram::Kind::kPress, .force_n = 3.0};
  press.place_mm = {0.0, aside_mm, 0.0};
  rig.set_hand(press);
  Pressed result;
  rig.run(6.0, [&] {
    if (!rig.record().in_contact || rig.record().displacement_mm < 0.5) return;
    result.hand_n.push_back(rig.truth().hand_force_n.z);
    result.fixture_along_n = std::max(result.fixture_along_n, std::abs(rig.record().fixture_force_n.z));
    result.lateral_mm = std::max(result.lateral_mm, std::abs(rig.truth().tip_position_mm.y - aside_mm));
  });
  return result;
}

TEST(ToolFixture, AddsNothingAlongThePress) {
  const Pressed without = pressed(false, 0.0);
  const Pressed with = pressed(true, 0.0);
  ASSERT_GT(with.hand_n.size(), 1000U);
  ASSERT_EQ(with.hand_n.size(), without.hand_n.size());
  EXPECT_EQ(with.fixture_along_n, 0.0);
  double largest_n = 0.0;
  for (std::size_t i = 0; i < with.hand_n.size(); ++i)
    largest_n = std::max(largest_n, std::abs(with.hand_n[i] - without.hand_n[i]));
  EXPECT_LE(largest_n, 0.020);
}

TEST(Assistance, WhatHasNoEvidenceOfAnObjectIsNoContact) {
  rt::Assistance assistance(1000.0);
  rt::AssistanceSpec spec;
  spec.fixture.emplace();
  spec.watch.emplace();
  assistance.exchange(spec);
  assistance.begin_guide({.goal_mm = {0.0, 0.0, -50.0}});
  assistance.begin_presentation();
  hal::RigSample sample;
  for (int i = 0; i < 1000; ++i) {
    // Declared by its force, again and again.
    assistance.update(sample, {.in_contact = i % 3 != 0}, true, 1e-3);
    assistance.observe({}, 1e-3);
    rt::TickRecord record;
    assistance.fill_record(record);
    EXPECT_EQ(record.guide_state, GuideState::kUnderWay);
  }
  assistance.cancel_guide();
  for (int i = 0; i < 1000; ++i) {
    sample.tip_position_mm = {0.0, 3.0, 0.01 * i};
    const hal::Vector3 force_n = assistance.update(sample, {.in_contact = true}, true, 1e-3);
    if (i > 300) {
      EXPECT_EQ(length(force_n), 0.0);
    }
    assistance.observe({.tip_mm = sample.tip_position_mm}, 1e-3);
  }
  EXPECT_EQ(assistance.end_presentation().contacts, 0U);
}

rt::ToolFixture::Situation in_contact_at(const hal::Vector3& tip_mm) {
  rt::ToolFixture::Situation now;
  now.tip_mm = tip_mm;
  now.interval_s = 1e-3;
  now.in_contact = true;
  return now;
}

TEST(ToolFixture, PushesBackFromBothWallsAndOnlyBack) {
  rt::ToolFixture fixture({}, {0.0, 0.0, -1.0});
  for (int i = 0; i < 100; ++i) EXPECT_EQ(length(fixture.update(in_contact_at({}))), 0.0);
  auto moved = in_contact_at({0.0, 0.0, 1.5});
  moved.in_contact = false;
  EXPECT_NEAR(fixture.update(moved).z, -0.5, 1e-12);  // a millimetre above the ceiling at 0.5 mm
  moved.velocity_mm_per_s = {0.0, 0.0, -10.0};        // on its way back, slowly and fast
  EXPECT_NEAR(fixture.update(moved).z, -0.375, 1e-12);
  moved.velocity_mm_per_s = {0.0, 0.0, -50.0};
  EXPECT_EQ(fixture.update(moved).z, 0.0);
  moved.velocity_mm_per_s = {0.0, 0.0, 50.0};
  EXPECT_NEAR(fixture.update(moved).z, -0.6, 1e-12);
  const hal::Vector3 aside_n = fixture.update(in_contact_at({0.0, 3.0, -2.0}));
  EXPECT_NEAR(aside_n.y, -1.0, 1e-12);
  EXPECT_EQ(aside_n.z, 0.0);
  EXPECT_NEAR(length(fixture.update(in_contact_at({8.0, 0.0, 4.0}))), 2.0, 1e-12);  // at most
}

TEST(ToolFixture, AToolThatTheHandLetsGoComesBackSlowly) {
  rt::SceneSpec spec = press_scene();
  spec.fixture.emplace();
  VirtualRun rig({}, spec);
  rig.set_hand({.kind = sim::HandProgram::Kind::kPress, .force_n = 2.5});
  rig.run(6.0);  // pressed, lifted, and held against the fixture
  const double start_mm = rig.truth().tip_position_mm.z;
  ASSERT_LT(rig.record().fixture_force_n.z, -1.5);
  rig.set_hand(following());
  double fastest_mm_per_s = 0.0;
  hal::Vector3 last_mm = rig.truth().tip_position_mm;
  rig.run(2.0, [&] {
    fastest_mm_per_s = std::max(fastest_mm_per_s, length(rig.truth().tip_position_mm - last_mm) / 1e-3);
    last_mm = rig.truth().tip_position_mm;
  });
  EXPECT_LT(fastest_mm_per_s, 120.0);
  EXPECT_LT(last_mm.z, start_mm - 2.0);
}

TEST(ToolFixture, AToolThatIsHeldAgainstItStandsStill) {
  for (const char* device : {"phantom_1_0", "phantom_1_5_high_force"}) {
    rt::SceneSpec spec = press_scene();
    spec.fixture.emplace();
    sim::SimulationConfig config;
    config.device = device;
    VirtualRun rig(config, spec);
    rig.set_hand({.kind = sim::HandProgram::Kind::kPress, .force_n = 2.5});
    rig.run(6.0);
    ASSERT_LT(rig.record().fixture_force_n.z, -1.5) << device;
    double least_n = 0.0;
    double most_n = -10.0;
    rig.run(2.0, [&] {
      least_n = std::min(least_n, rig.record().fixture_force_n.z);
      most_n = std::max(most_n, rig.record().fixture_force_n.z);
    });
    EXPECT_LT(most_n - least_n, 0.2) << device;
  }
}

TEST(ToolFixture, LetsGoOfAToolThatIsPulledAwayAndOfWhatWasNoContact) {
  rt::ToolFixture fixture({}, {0.0, 0.0, -1.0});
  for (int i = 0; i < 100; ++i) fixture.update(in_contact_at({}));
  auto away = in_contact_at({0.0, 0.0, 12.0});
  away.in_contact = false;
  for (int i = 0; i < 60; ++i) fixture.update(away);
  EXPECT_EQ(length(fixture.update(away)), 0.0);
  away.tip_mm.z = 2.0;
  EXPECT_EQ(length(fixture.update(away)), 0.0);  // until the next contact

  for (int i = 0; i < 100; ++i) fixture.update(in_contact_at({}));
  away.is_withdrawn = true;
  fixture.update(away);
  away.is_withdrawn = false;
  for (int i = 0; i < 60; ++i) fixture.update(away);
  EXPECT_EQ(length(fixture.update(away)), 0.0);

  for (int i = 0; i < 100; ++i) fixture.update(in_contact_at({}));  // a jerk in the air later is not a reason
  fixture.update(away);
  away.is_withdrawn = true;
  for (int i = 0; i < 60; ++i) fixture.update(away);
  EXPECT_NEAR(fixture.update(away).z, -0.75, 1e-12);
}

TEST(ToolFixture, GivesNothingWhileTheToolIsGuided) {
  rt::ToolFixture fixture({}, {0.0, 0.0, -1.0});
  for (int i = 0; i < 100; ++i) fixture.update(in_contact_at({}));
  auto up = in_contact_at({0.0, 0.0, 2.0});
  up.in_contact = false;
  up.is_guided = true;
  for (int i = 0; i < 60; ++i) fixture.update(up);
  EXPECT_EQ(length(fixture.update(up)), 0.0);
}

TEST(PresentationMonitor, JudgesAPress) {
  rt::SceneSpec spec = press_scene();
  spec.watch.emplace();
  VirtualRun rig({}, spec);
  rig.set_hand({.kind = sim::HandProgram::Kind::kPress, .force_n = 3.0});
  rig.run(0.1);
  EXPECT_EQ(rig.assistance().end_presentation().number, 0U);  // none is under way
  ASSERT_EQ(rig.assistance().begin_presentation(), 1U);
  double depth_mm = 0.0;
  double force_n = 0.0;
  double speed_mm_per_s = 0.0;
  double last_z_mm = rig.truth().tip_position_mm.z;
  rig.run(7.0, [&] {
    depth_mm = std::max(depth_mm, rig.record().displacement_mm);
    if (rig.record().in_contact) force_n = std::max(force_n, rig.record().reaction_force_n);
    speed_mm_per_s = std::max(speed_mm_per_s, (last_z_mm - rig.truth().tip_position_mm.z) / 1e-3);
    last_z_mm = rig.truth().tip_position_mm.z;
    EXPECT_EQ(rig.record().presentation, 1U);
  });
  const rt::PresentationSummary summary = rig.assistance().end_presentation();
  EXPECT_EQ(summary.number, 1U);
  EXPECT_EQ(summary.broken, 0U);
  EXPECT_EQ(summary.contacts, 1U);
  EXPECT_EQ(summary.end_tick - summary.begin_tick, 6999U);
  EXPECT_EQ(summary.peak_displacement_mm, depth_mm);
  EXPECT_NEAR(summary.peak_press_speed_mm_per_s, speed_mm_per_s, 0.1 * speed_mm_per_s + 2.0);
  EXPECT_EQ(summary.peak_force_n, force_n);
  EXPECT_GT(force_n, 0.5);
}

TEST(PresentationMonitor, NamesWhatWasWrong) {
  rt::SceneSpec spec = press_scene();
  spec.watch.emplace();
  spec.watch->max_contact_speed_mm_per_s = 50.0;
  spec.watch->max_contacts = 3;
  spec.watch->min_lateral_path_mm = 60.0;
  VirtualRun rig({}, spec);
  sim::HandProgram tap{.kind = sim::HandProgram::Kind::kTap, .speed_mm_per_s = 250.0};
  tap.repetitions = 5;
  rig.set_hand(tap);
  rig.run(0.1);
  rig.assistance().begin_presentation();
  rig.run(6.0);
  EXPECT_EQ(rig.assistance().end_presentation().broken,
            rt::watch_bit::kPressSpeed | rt::watch_bit::kContactSpeed | rt::watch_bit::kContacts |
                rt::watch_bit::kLateralPath);

  rig.assistance().begin_presentation();
  rig.run(0.1);
  rig.renderer().raise(rt::GuardFault::kStopped);
  rig.run(0.1);
  const auto idle = rig.assistance().end_presentation();
  EXPECT_EQ(idle.number, 2U);
  EXPECT_EQ(idle.broken, rt::watch_bit::kLateralPath | rt::watch_bit::kNoContact | rt::watch_bit::kGuard);
}

/// A contact that is lost for a moment in the middle of a fast stroke does not begin with the stroke's speed.
TEST(PresentationMonitor, AContactThatFlickersIsTheSame) {
  rt::WatchLimits limits;
  limits.max_contact_speed_mm_per_s = 50.0;
  rt::PresentationMonitor watch(limits, {0.0, 0.0, -1.0}, 1000.0);
  watch.begin(1);
  rt::WatchedTick now;
  const auto run = [&](int ticks, bool is_touched, const hal::Vector3& velocity_mm_per_s) {
    for (int i = 0; i < ticks; ++i) {
      ++now.tick;
      now.tip_mm = now.tip_mm + velocity_mm_per_s * 1e-3;
      watch.update(now, is_touched, velocity_mm_per_s, 1e-3);
    }
  };
  run(200, false, {0.0, 0.0, -15.0});
  run(200, true, {0.0, 0.0, -10.0});
  run(100, true, {80.0, 0.0, 0.0});
  run(40, false, {80.0, 0.0, 0.0});
  run(100, true, {80.0, 0.0, 0.0});
  EXPECT_EQ(watch.summary().contacts, 1U);
  EXPECT_NEAR(watch.summary().peak_contact_speed_mm_per_s, 15.0, 1e-9);
  EXPECT_EQ(watch.summary().broken & rt::watch_bit::kContactSpeed, 0U);
  // Lost for longer it is a new one, and it began fast.
  run(60, false, {80.0, 0.0, 0.0});
  run(10, true, {80.0, 0.0, 0.0});
  EXPECT_EQ(watch.summary().contacts, 2U);
  EXPECT_NE(watch.summary().broken & rt::watch_bit::kContactSpeed, 0U);
}

// An object that is brushed for a moment is felt as it is. A participant who judges it has not felt the target.
TEST(PresentationMonitor, ABriefTouchIsNoPresentation) {
  const auto flaws_after = [](int ticks_touched) {
    rt::PresentationMonitor watch({}, {0.0, 0.0, -1.0}, 1000.0);
    watch.begin(1);
    for (int i = 0; i < 500; ++i) watch.update({}, i >= 100 && i < 100 + ticks_touched, {}, 1e-3);
    return watch.end().broken;
  };
  EXPECT_EQ(flaws_after(0), rt::watch_bit::kNoContact);
  EXPECT_EQ(flaws_after(250), rt::watch_bit::kContactTime);
  EXPECT_EQ(flaws_after(350), 0U);
}

TEST(PresentationMonitor, IsThereOnlyWhereTheSceneHasOne) {
  VirtualRun rig({}, press_scene());
  EXPECT_EQ(rig.assistance().begin_presentation(), 0U);
  rig.run(0.01);
  EXPECT_EQ(rig.record().channels & rt::channel::kAssist, 0U);
}

}  // namespace
}  // namespace hapticd::study
