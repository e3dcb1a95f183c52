#include "rt/deformation/fused_displacement.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

namespace hapticd::rt {
namespace {

constexpr double kLawError = 0.05;
constexpr double kNoiseN = 0.003;

TEST(FusedDisplacement, IsBetweenItsSourcesWhateverTheySayAndAtMostAsUncertain) {
  std::mt19937_64 random(30);
  std::uniform_real_distribution<double> size(-6.0, 3.0);
  std::normal_distribution<double> normal(0.0, 1.0);
  const auto wild = [&] { return std::pow(10.0, size(random)); };
  for (int round = 0; round < 50; ++round) {
    const double law_error = std::min(1.0, wild());
    FusedDisplacement fused(law_error, kNoiseN, 1000.0);
    fused.begin(wild(), wild() * 0.01);
    double deepest_mm = fused.displacement_mm();
    for (int i = 0; i < 2000; ++i) {
      const double way = wild() * normal(random);
      const double slide = i % 3 == 0 ? 0.0 : wild();
      const LawEstimate law{wild(), wild()};
      const double by_path = fused.displacement_mm() + way;
      const double certain_before = std::hypot(fused.deviation_mm(), 0.08 * std::sqrt(5.0 * slide));
      fused.update(way, slide, law);
      const double slack = 1e-9 * (std::abs(by_path) + law.displacement_mm);
      ASSERT_GE(fused.displacement_mm(), std::min(by_path, law.displacement_mm) - slack);
      ASSERT_LE(fused.displacement_mm(), std::max(by_path, law.displacement_mm) + slack);
      ASSERT_GE(fused.deviation_mm(), 0.0);
      deepest_mm = std::max(deepest_mm, fused.displacement_mm());
      const double of_law_mm = std::hypot(law.mm_per_n * kNoiseN, law_error * deepest_mm + 0.05);
      ASSERT_LE(fused.deviation_mm(), std::hypot(certain_before, of_law_mm) * (1.0 + 1e-12));
    }
  }
}

TEST(FusedDisplacement, AnExactlyKnownContactThatIsPressedFollowsTheWayExactly) {
  FusedDisplacement fused(kLawError, kNoiseN, 1000.0);
  fused.begin(0.1, 0.0);
  double way = 0.1;
  for (int i = 0; i < 60'000; ++i) {
    const double step = 0.01 * std::sin(0.01 * i);
    way += step;
    fused.update(step, 0.0, {0.5 * way, 2.0});  // a law that is off by half
    ASSERT_NEAR(fused.displacement_mm(), way, 1e-9);
    ASSERT_EQ(fused.deviation_mm(), 0.0);
  }
}

TEST(FusedDisplacement, APressIsMeasuredByTheWayWithinItsOnset) {
  FusedDisplacement fused(0.1, kNoiseN, 1000.0);
  fused.begin(0.1, 0.03);
  double way = 0.1;
  for (int i = 0; i < 2000; ++i) {
    way += 0.005;
    fused.update(0.005, 0.0, {0.9 * way, 2.0});  // off by its 10 %: 1 mm in the end
    ASSERT_NEAR(fused.displacement_mm(), way, 0.06) << "of 10 mm; the law is off by 1 mm there";
  }
}

TEST(FusedDisplacement, WhatSlidingDriftsTheLawCorrects) {
  // The direction is 4° off: of 300 mm of stroking back and forth 21 mm would be taken for displacement.
  FusedDisplacement fused(kLawError, kNoiseN, 1000.0);
  const double true_mm = 4.0;
  fused.begin(true_mm, 0.03);
  double drifted = true_mm;
  double largest = 0.0;
  for (int i = 0; i < 6000; ++i) {
    const double slide = 0.05;
    const double way = 0.07 * slide;
    drifted += way;
    fused.update(way, slide, {true_mm * 1.03, 2.0});
    largest = std::max(largest, std::abs(fused.displacement_mm() - true_mm));
  }
  EXPECT_GT(drifted, 24.0);
  EXPECT_LT(largest, 0.8);
  EXPECT_LT(std::abs(fused.displacement_mm() - true_mm), 0.8);
}

TEST(FusedDisplacement, AtSmallForceTheWayIsTrustedAtLargeForceTheLaw) {
  const auto after_a_slide = [](double mm_per_n) {
    FusedDisplacement fused(0.01, kNoiseN, 1000.0);
    fused.begin(1.0, 0.03);
    for (int i = 0; i < 50; ++i) fused.update(0.0, 0.02, {2.0, mm_per_n});
    return fused.displacement_mm();  // way 1 mm, law 2 mm
  };
  EXPECT_LT(after_a_slide(1000.0), 1.1) << "3 mN are 3 mm";
  EXPECT_GT(after_a_slide(1.0), 1.25);
}

TEST(FusedDisplacement, TheCertaintyItClaimsDoesNotDependOnTheRate) {
  const auto run = [](double rate_hz) {
    FusedDisplacement fused(kLawError, kNoiseN, rate_hz);
    fused.begin(1.0, 0.03);
    const int ticks = static_cast<int>(rate_hz);
    for (int i = 0; i < ticks; ++i) fused.update(0.0, 60.0 / rate_hz, {3.0, 0.0});  // no noise: ε alone
    return fused;
  };
  EXPECT_NEAR(run(5000.0).displacement_mm(), run(1000.0).displacement_mm(), 0.01);
  EXPECT_NEAR(run(5000.0).deviation_mm() / run(1000.0).deviation_mm(), 1.0, 0.03);
}

TEST(FusedDisplacement, AMinuteAtRestChangesNothingButTowardsTheLaw) {
  FusedDisplacement fused(kLawError, kNoiseN, 1000.0);
  fused.begin(3.0, 0.2);
  double last = 3.0;
  const double deviation = fused.deviation_mm();
  for (int i = 0; i < 60'000; ++i) {
    fused.update(0.0, 0.0, {3.5, 2.0});
    ASSERT_GE(fused.displacement_mm(), last);
    last = fused.displacement_mm();
  }
  EXPECT_LE(last, 3.5);
  EXPECT_LT(fused.deviation_mm(), deviation);
}

TEST(FusedDisplacement, NoNumberOfReadingsAveragesTheLawsErrorOut) {
  FusedDisplacement fused(kLawError, kNoiseN, 1000.0);
  fused.begin(4.0, 0.03);
  // Slid for ten minutes, it knows what the law says, and that is off by its error.
  for (int i = 0; i < 600'000; ++i) fused.update(0.0, 0.05, {4.0 * (1.0 + kLawError), 2.0});
  EXPECT_GT(fused.deviation_mm(), 0.5 * kLawError * 4.0);
  EXPECT_LT(std::abs(fused.displacement_mm() - 4.0), 2.0 * fused.deviation_mm());
  // Let go to a millimetre, it is less certain than a press to there.
  for (int i = 0; i < 30; ++i) fused.update(-0.1, 0.0, {4.2 - 0.1 * (i + 1), 2.0});
  EXPECT_GT(fused.deviation_mm(), 2.0 * kLawError);
}

}  // namespace
}  // namespace hapticd::rt
