#include "hal/phantom/motion_check.h"

#include <gtest/gtest.h>

namespace hapticd::phantom {
namespace {

constexpr std::array<double, 3> kRadPerCount{1e-4, 1e-4, 1e-4};
constexpr std::int64_t kMs = 1'000'000;

TEST(MotionCheck, AJointFasterThanAnArmHasJumped) {
  MotionCheck check(60.0, kRadPerCount, 1500.0);
  ASSERT_TRUE(check.plausible({0.0, 0.0, 0.0}, kMs)) << "the first says nothing";
  EXPECT_TRUE(check.plausible({0.05, 0.0, 0.0}, 2 * kMs));
  EXPECT_FALSE(check.plausible({0.05, -0.1, 0.0}, 3 * kMs));
  EXPECT_EQ(check.jumped_joint(), 1);
  check.restart();
  EXPECT_TRUE(check.plausible({9.0, 9.0, 9.0}, 4 * kMs));
}

TEST(MotionCheck, ALateLookAllowsMore) {
  MotionCheck check(60.0, kRadPerCount, 1500.0);
  ASSERT_TRUE(check.plausible({0.0, 0.0, 0.0}, kMs));
  EXPECT_TRUE(check.plausible({0.5, 0.0, 0.0}, 11 * kMs));
  EXPECT_FALSE(check.plausible({100.0, 0.0, 0.0}, 100'000 * kMs)) << "but not anything";
}

TEST(MotionCheck, TwoLooksInARowAreNoSprint) {
  MotionCheck check(60.0, kRadPerCount, 1500.0);
  check.follow({0.0, 0.0, 0.0}, 1000);
  check.follow({0.03, 0.0, 0.0}, 2000);  // a count within a microsecond would be 30 m/s
  EXPECT_FALSE(check.over_speed());
  check.follow({0.03, 0.0, 0.0}, 3 * kMs);
  EXPECT_FALSE(check.over_speed());
}

TEST(MotionCheck, TooFastIsReportedUntilItIsClearlySlower) {
  MotionCheck check(60.0, kRadPerCount, 1000.0);
  double x = 0.0;
  std::int64_t now = kMs;
  const auto move = [&](double mm_per_s) {
    for (int k = 0; k < 4; ++k) {
      x += 1e-3 * mm_per_s;
      now += kMs;
      check.follow({x, 0.0, 0.0}, now);
    }
    return check.over_speed();
  };
  EXPECT_FALSE(move(990.0));
  EXPECT_TRUE(move(1010.0));
  EXPECT_TRUE(move(950.0));
  EXPECT_FALSE(move(880.0));
}

}  // namespace
}  // namespace hapticd::phantom
