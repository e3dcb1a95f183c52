#include "hal/sim/simulated_turntable.h"

#include <gtest/gtest.h>

#include <chrono>
#include <thread>

namespace hapticd::sim {
namespace {

turntable::TurntableSettings settings() {
  turntable::TurntableSettings settings;
  settings.speed_deg_per_s = 360.0;
  settings.acceleration_deg_per_s2 = 1440.0;
  settings.stale_after_s = 5.0;
  settings.stations = {{"front", 0.0, ""}, {"back", 170.0, ""}};
  return settings;
}

hal::TurntableStatus end_of(hal::Turntable& table, const hal::Result<std::uint64_t>& motion) {
  EXPECT_TRUE(motion) << (motion ? "" : motion.error().text());
  const auto until = std::chrono::steady_clock::now() + std::chrono::seconds(20);
  while (motion && std::chrono::steady_clock::now() < until) {
    hal::TurntableStatus now = table.status();
    if (now.motion.number == *motion && now.motion.end != hal::MotionEnd::kUnderWay) return now;
    std::this_thread::sleep_for(std::chrono::milliseconds(2));
  }
  return table.status();
}

TEST(SimulatedTurntable, DoesNotKnowWhereItIsBeforeItIsHomed) {
  auto table = create_turntable({.start_deg = -33.0}, settings());
  ASSERT_TRUE(table);
  ASSERT_FALSE((*table)->engage());
  EXPECT_EQ((*table)->status().state, hal::TurntableState::kNotHomed);
  EXPECT_EQ(*(*table)->status().position_deg, 0.0);  // what its counter says, not where it is
  EXPECT_EQ(end_of(**table, (*table)->home()).motion.end, hal::MotionEnd::kArrived);
  EXPECT_EQ((*table)->status().station, "front");
}

TEST(SimulatedTurntable, TakesTheTimeItsLimitsAllow) {
  auto table = create_turntable({.homed = true}, settings());
  ASSERT_TRUE(table);
  ASSERT_FALSE((*table)->engage());
  const hal::TurntableStatus end = end_of(**table, (*table)->move_to(170.0, {180.0, 360.0}));
  EXPECT_EQ(end.motion.end, hal::MotionEnd::kArrived);
  EXPECT_GE(end.motion.elapsed_s, (170.0 - 25.0) / 180.0 + 180.0 / 360.0 - 0.1);
  EXPECT_NEAR(*end.position_deg, 170.0, 0.02);
  EXPECT_EQ(end.station, "back");
}

TEST(SimulatedTurntable, KeepsItsPlaceWhileItIsNotEngaged) {
  auto table = create_turntable({.homed = true}, settings());
  ASSERT_TRUE(table);
  ASSERT_FALSE((*table)->engage());
  EXPECT_EQ(end_of(**table, (*table)->move_to(170.0, {})).motion.end, hal::MotionEnd::kArrived);
  (*table)->disengage();
  EXPECT_FALSE((*table)->status().position_deg);
  ASSERT_FALSE((*table)->engage());
  EXPECT_EQ((*table)->status().station, "back");
}

}  // namespace
}  // namespace hapticd::sim
