#include "server/pose/rig_clock.h"

#include <gtest/gtest.h>

namespace hapticd::pose {
namespace {

TEST(RigClock, KnowsNothingBeforeTheFirstReading) {
  const RigClock clock;
  EXPECT_FALSE(clock.daemon_time(5));
}

TEST(RigClock, KeepsTheNarrowestBoundsAndTheTruthWithin) {
  constexpr std::int64_t kOffsetNs = 123'456'789;
  RigClock clock;
  std::uint32_t random = 7;
  for (int i = 0; i < 1000; ++i) {
    random = random * 1664525U + 1013904223U;
    const std::int64_t rig_ns = 1'000'000LL * i;
    const std::int64_t before_ns = random % 50'000, after_ns = (random >> 16) % 80'000;
    clock.follow({rig_ns, rig_ns + kOffsetNs - before_ns, rig_ns + kOffsetNs + after_ns});
    const auto time = clock.daemon_time(rig_ns);
    ASSERT_TRUE(time);
    EXPECT_LE(std::abs(time->time_ns - (rig_ns + kOffsetNs)), time->bound_ns);
  }
  EXPECT_LT(clock.daemon_time(0)->bound_ns, 500);
  EXPECT_EQ(clock.restarts(), 0U);
}

TEST(RigClock, BeginsAgainWhereTheRigLeftTimeOut) {
  RigClock clock;
  clock.follow({1000, 5000, 5100});
  clock.follow({2000, 106'000, 106'100});  // 100 µs were left out
  EXPECT_EQ(clock.restarts(), 1U);
  EXPECT_EQ(clock.daemon_time(2000)->time_ns, 106'050);
}

TEST(RigClock, LeavesOutAReadingThatEndedBeforeItBegan) {
  RigClock clock;
  clock.follow({1000, 5100, 5000});
  EXPECT_FALSE(clock.daemon_time(0));
}

}  // namespace
}  // namespace hapticd::pose
