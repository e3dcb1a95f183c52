#include "server/pose/tip_motion.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "tests/unit/pose/milliseconds.h"

namespace hapticd::pose {
namespace {

TEST(TipMotion, OfAStraightLineTheVelocityIsTheSlopeAtUnevenTimes) {
  TipMotion motion;
  std::int64_t time_ns = 7 * kMs;
  for (int i = 0; i < 40; ++i) {
    time_ns += i % 3 == 0 ? 2 * kMs : kMs;
    const double s = 1e-9 * static_cast<double>(time_ns);
    motion.follow({100.0 * s, -30.0 * s, 5.0}, time_ns);
  }
  const TipMotion::Velocity velocity = motion.velocity();
  ASSERT_TRUE(velocity.known);
  EXPECT_NEAR(velocity.mm_per_s.x(), 100.0, 1e-6);
  EXPECT_NEAR(velocity.mm_per_s.y(), -30.0, 1e-6);
  EXPECT_NEAR(velocity.mm_per_s.z(), 0.0, 1e-9);
}

TEST(TipMotion, UnderAccelerationItIsTheVelocityItsLagBefore) {
  TipMotion motion;
  constexpr double kAcceleration = 2000.0;
  double s = 0.0;
  for (int i = 0; i <= 50; ++i) {
    s = 1e-3 * i;
    motion.follow({0.5 * kAcceleration * s * s, 0.0, 0.0}, i * kMs);
  }
  const TipMotion::Velocity velocity = motion.velocity();
  EXPECT_NEAR(velocity.mm_per_s.x(), kAcceleration * (s - velocity.lag_s), 1e-6);
  EXPECT_NEAR(velocity.lag_s, 0.5 * TipMotion::kWindowS, 1e-9);
}

TEST(TipMotion, TheStatedNoiseIsThatOfWhiteNoise) {
  TipMotion motion;
  double sum = 0.0;
  int count = 0;
  std::uint32_t random = 1;
  double stated = 0.0;
  for (int i = 0; i < 20000; ++i) {
    random = random * 1664525U + 1013904223U;
    const double noise = static_cast<double>(random) / 4294967296.0 - 0.5;  // deviation sqrt(1/12)
    motion.follow({noise, 0.0, 0.0}, i * kMs);
    if (i % 20 != 19) continue;
    stated = motion.velocity().noise_per_mm * std::sqrt(1.0 / 12.0);
    sum += motion.velocity().mm_per_s.squaredNorm();
    ++count;
  }
  EXPECT_NEAR(std::sqrt(sum / count) / stated, 1.0, 0.1);
}

TEST(TipMotion, BeginsAgainAfterAGapAndWhenTimeRunsBackwards) {
  TipMotion motion;
  for (int i = 0; i < 10; ++i) motion.follow({1.0 * i, 0.0, 0.0}, i * kMs);
  EXPECT_TRUE(motion.velocity().known);
  motion.follow({500.0, 0.0, 0.0}, 80 * kMs);
  EXPECT_FALSE(motion.velocity().known) << "a jump over a gap is no velocity";
  for (int i = 0; i < 10; ++i) motion.follow({1.0 * i, 0.0, 0.0}, (100 + i) * kMs);
  motion.follow({0.0, 0.0, 0.0}, 5 * kMs);
  EXPECT_FALSE(motion.velocity().known);
  EXPECT_EQ(motion.velocity().mm_per_s.norm(), 0.0);
}

TEST(TipMotion, LeavesOutWhatIsNoNumberAndWhatComesTooSoon) {
  TipMotion motion;
  for (int i = 0; i < 10; ++i) {
    motion.follow({1.0 * i, 0.0, 0.0}, i * kMs);
    motion.follow({std::numeric_limits<double>::quiet_NaN(), 0.0, 0.0}, i * kMs + kMs / 2);
    motion.follow({1.0 * i, 0.0, 0.0}, i * kMs + kMs / 4);
  }
  EXPECT_NEAR(motion.velocity().mm_per_s.x(), 1000.0, 1e-6);
}

TEST(TipMotion, KnowsWhereThePointWasWithinTheLastTenthOfASecond) {
  TipMotion motion;
  for (int i = 0; i < 300; ++i) motion.follow({0.1 * i, 0.0, 0.0}, i * kMs);
  ASSERT_TRUE(motion.position_mm(250 * kMs + kMs / 2));
  EXPECT_NEAR(motion.position_mm(250 * kMs + kMs / 2)->x(), 25.05, 1e-9);
  EXPECT_NEAR(motion.position_mm(299 * kMs)->x(), 29.9, 1e-9);
  EXPECT_FALSE(motion.position_mm(300 * kMs)) << "the future";
  EXPECT_FALSE(motion.position_mm(100 * kMs)) << "forgotten";
}

}  // namespace
}  // namespace hapticd::pose
