#include <gtest/gtest.h>

#include <cmath>

#include "hal/openhaptics/device_frame.h"
#include "hd_bench.h"
#include "tests/emulators/bench/emulated_bench.h"

namespace hapticd::test {
namespace {

using emulators::BenchConfig;
using emulators::BenchTruth;
using emulators::EmulatedBench;
using sim::HandProgram;

/// The driver on a device whose tip is held by the simulated hand.
class OnTheBench : public testing::Test {
 protected:
  void set_up(BenchConfig config = {}, const hal::Vector3& origin_mm = {}) {
    config.simulation.seed = 3;
    config.origin_mm = origin_mm;
    hd = std::make_unique<HdBench>([&](OpenHapticsConfig& c) { c.origin_mm = origin_mm; });
    auto made = EmulatedBench::create(config, hd->page, [this](const hal::Vector3& f, const hal::Vector3&) {
      readings.fetch_add(1, std::memory_order_relaxed);
      sensor_z_n.store(f.z, std::memory_order_relaxed);
    });
    ASSERT_TRUE(made) << made.error().text();
    world = std::move(*made);
    world->start();
    ASSERT_FALSE(hd->device->engage());
  }
  /// The hand presses with 2 N and holds.
  void run_under_a_press() {
    HandProgram press{.kind = HandProgram::Kind::kPress,
                      .force_n = 2.0,
                      .force_rate_n_per_s = 10.0,
                      .approach_mm_per_s = 100.0,
                      .hold_s = 60.0,
                      .travel_s = 0.2};
    ASSERT_FALSE(world->set_program(press));
    hd->start_running();
  }
  void TearDown() override {
    if (hd != nullptr) hd->stop_running();
    world = nullptr;  // before its page
    hd = nullptr;
  }
  bool truly(const std::function<bool(const BenchTruth&)>& condition) {
    return eventually([&] {
      const auto latest = world->latest();
      return latest && condition(*latest);
    });
  }

  std::atomic<std::uint64_t> readings{0};
  std::atomic<double> sensor_z_n{0.0};
  std::unique_ptr<HdBench> hd;
  std::unique_ptr<EmulatedBench> world;
};

TEST_F(OnTheBench, APressingHandFeelsTheForceThatIsRendered) {
  set_up();
  run_under_a_press();
  ASSERT_TRUE(truly([](const BenchTruth& t) { return t.truth.in_contact && t.truth.normal_force_n > 1.5; }));

  // The sensor shows the object's reaction, the driver of where the tip is.
  EXPECT_TRUE(eventually([&] {
    return std::abs(sensor_z_n - world->latest()->truth.reaction_force_n.z) < 0.2;
  })) << sensor_z_n
      << " against " << world->latest()->truth.reaction_force_n.z;
  EXPECT_TRUE(eventually([&] {
    return std::abs(hd->body->sample().tip_position_mm.z - world->latest()->encoder_position_mm.z) < 0.1;
  }));
  EXPECT_LT(hd->body->sample().tip_position_mm.z, 0.0);

  // A force upwards: the motors give it, and the hand that means to press with 2 N presses the object with
  // less than it exerts itself.
  hd->body->ask({0.0, 0.0, 1.0});
  EXPECT_TRUE(truly([](const BenchTruth& t) { return std::abs(t.truth.device_force_n.z - 1.0) < 0.01; }));
  EXPECT_TRUE(truly([](const BenchTruth& t) {
    return t.truth.reaction_force_n.z < -t.truth.hand_force_n.z - 0.6;
  })) << world->latest()->truth.reaction_force_n.z
      << " against " << world->latest()->truth.hand_force_n.z;

  // It ends with the run.
  hd->stop_running();
  EXPECT_TRUE(truly([](const BenchTruth& t) { return std::abs(t.truth.device_force_n.z) < 0.01; }));
}

TEST_F(OnTheBench, WhatIsAskedSidewaysPushesThatWay) {
  set_up();
  hd->start_running();
  ASSERT_TRUE(hd->ticks(20));
  for (const hal::Vector3& force : {hal::Vector3{0.5, 0.0, 0.0}, hal::Vector3{0.0, 0.5, 0.0}}) {
    hd->body->ask({});
    ASSERT_TRUE(truly(
        [](const BenchTruth& t) { return dot(t.truth.device_force_n, t.truth.device_force_n) < 1e-4; }));
    const hal::Vector3 before = hd->body->sample().tip_position_mm;
    hd->body->ask(force);
    EXPECT_TRUE(truly([&](const BenchTruth& t) {
      const hal::Vector3 off = t.truth.device_force_n - force;
      return dot(off, off) < 1e-4;
    }));
    // Work is done on the hand in the driver's own coordinates.
    EXPECT_TRUE(eventually([&] { return dot(hd->body->sample().tip_position_mm - before, force) > 0.02; }));
  }
}

TEST_F(OnTheBench, PoseAndOrientationComeThroughTheVendorsFrame) {
  set_up({}, {100.0, -50.0, 20.0});
  HandProgram sway{.kind = HandProgram::Kind::kSway,
                   .hold_s = -1.0,
                   .place_mm = {15.0, -10.0, 5.0},
                   .travel_s = 0.3,
                   .tilt_deg = 30.0};
  ASSERT_FALSE(world->set_program(sway));
  hd->start_running();
  ASSERT_TRUE(truly([](const BenchTruth& t) { return t.truth.tip_position_mm.x > 5.0; }));
  double furthest_tilt = 0.0;
  EXPECT_TRUE(eventually([&] {
    const hal::Quaternion q = hd->body->sample().tip_orientation;
    furthest_tilt = std::max(furthest_tilt, std::acos(std::min(1.0, 1.0 - 2.0 * (q.x * q.x + q.y * q.y))));
    return furthest_tilt > 0.3;
  })) << furthest_tilt;
  // All three axes at a moment of little motion between the two threads.
  EXPECT_TRUE(eventually([&] {
    const hal::Vector3 read = hd->body->sample().tip_position_mm;
    const hal::Vector3 off = read - world->latest()->encoder_position_mm;
    return dot(off, off) < 0.5 * 0.5;
  }));
}

TEST_F(OnTheBench, AnObjectVanishesUnderAPressAndForceInFreeAirIsReported) {
  set_up();
  run_under_a_press();
  ASSERT_TRUE(truly([](const BenchTruth& t) { return t.truth.normal_force_n > 1.5; }));
  hd->body->ask({0.0, 0.0, 0.5});
  ASSERT_TRUE(truly([](const BenchTruth& t) { return t.truth.device_force_n.z > 0.45; }));
  ASSERT_FALSE(world->happen({.kind = sim::ObjectEvent::Kind::kVanish}));
  ASSERT_TRUE(truly([](const BenchTruth& t) { return !t.truth.in_contact; }));
  const std::size_t gone = world->truth_count();
  ASSERT_TRUE(eventually([&] { return world->truth_count() > gone + 200; }));
  world->stop();
  EXPECT_FALSE(world->latest()->truth.in_contact);
  EXPECT_NEAR(world->free_air().max_n(), 0.5, 0.01) << "the driver's body asks for it all the same";
  EXPECT_GT(world->free_air().longest_ms(), 20.0);
  EXPECT_FALSE(world->free_air().holds());
}

TEST_F(OnTheBench, TurnsAtItsRateAndKeepsTheTruthAsASeries) {
  set_up();
  ASSERT_TRUE(eventually([&] { return world->truth_count() > 500; }));
  world->stop();
  const std::vector<BenchTruth> series = world->truth_from(0);
  ASSERT_EQ(series.size(), world->truth_count());
  for (std::size_t i = 1; i < series.size(); ++i) {
    EXPECT_GT(series[i].monotonic_ns, series[i - 1].monotonic_ns);
    EXPECT_GE(series[i].time_ns, series[i - 1].time_ns);
  }
  EXPECT_GE(readings, world->turns());  // a reading with every turn
  EXPECT_EQ(world->truths_lost(), 0U);
  // By the clock: turns made and missed together are 7000 a second.
  const double elapsed_s = 1e-9 * static_cast<double>(series.back().monotonic_ns - series[1].monotonic_ns);
  const double turns = static_cast<double>(world->turns() + world->turns_missed());
  EXPECT_NEAR(turns / elapsed_s, 7000.0, 350.0);
}

TEST(EmulatedBenchConfiguration, IsChecked) {
  TemporaryFolder folder;
  HdPage page(folder.path("page"));
  BenchConfig config{.rate_hz = 1e6};
  EXPECT_FALSE(EmulatedBench::create(config, page, {}));
  config = {};
  config.simulation.object = "nothing like it";
  EXPECT_FALSE(EmulatedBench::create(config, page, {}));
  config = {};
  config.truth_capacity = 3;
  config.truth_every = 1;
  auto world = EmulatedBench::create(config, page, {});
  ASSERT_TRUE(world);
  (*world)->start();
  EXPECT_TRUE(eventually([&] { return (*world)->truths_lost() > 2; }));
  EXPECT_EQ((*world)->truth_count(), 3U);
}

}  // namespace
}  // namespace hapticd::test
