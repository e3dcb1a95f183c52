#include "hal/phantom/winding_heat.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

namespace hapticd::phantom {
namespace {

constexpr double kPeakA = 5.5;
constexpr double kForEverA = 1.15;
constexpr double kTauS = 12.0;

TEST(WindingHeat, TheContinuousCurrentMayFlowForEver) {
  WindingHeat heat;
  for (int k = 0; k < 200'000; ++k) heat.advance(kForEverA, kForEverA, kTauS, 1e-3);
  EXPECT_NEAR(heat.heat(), 1.0, 1e-6);
  EXPECT_FALSE(heat.over());
  EXPECT_DOUBLE_EQ(WindingHeat{}.allowed_a(kPeakA, kForEverA), kPeakA) << "a cold motor may have its peak";
}

TEST(WindingHeat, IsExactWhateverTheStep) {
  WindingHeat fine;
  WindingHeat coarse;
  for (int k = 0; k < 1000; ++k) fine.advance(2.0, kForEverA, kTauS, 1e-3);
  coarse.advance(2.0, kForEverA, kTauS, 1.0);
  EXPECT_NEAR(fine.heat(), coarse.heat(), 1e-12);
  EXPECT_NEAR(coarse.heat(), std::pow(2.0 / kForEverA, 2) * (1.0 - std::exp(-1.0 / kTauS)), 1e-12);
}

TEST(WindingHeat, NoDemandTakesItBeyondWhatItBears) {
  WindingHeat heat;
  double allowed = kPeakA;
  double hottest = 0.0;
  double warm_at_s = -1.0;
  for (int k = 0; k < 100'000; ++k) {
    heat.advance(allowed, kForEverA, kTauS, 1e-3);
    allowed = heat.allowed_a(kPeakA, kForEverA);
    hottest = std::max(hottest, heat.heat());
    if (warm_at_s < 0.0 && heat.warm()) warm_at_s = 1e-3 * k;
    ASSERT_GE(allowed, kForEverA - 1e-12);
    ASSERT_LE(allowed, kPeakA);
  }
  // Peak: 22.9 times the heat that is borne; 0.8 is reached after -τ ln(1 - 0.8/22.9).
  EXPECT_NEAR(warm_at_s, -kTauS * std::log(1.0 - 0.8 * std::pow(kForEverA / kPeakA, 2)), 0.002);
  EXPECT_LE(hottest, 1.0 + 1e-9);
  EXPECT_NEAR(allowed, kForEverA, 0.1);
}

TEST(WindingHeat, ALittleBeyondTheContinuousCurrentIsLeft) {
  WindingHeat heat;
  heat.advance(kPeakA, kForEverA, kTauS, -kTauS * std::log(1.0 - 1.05 * std::pow(kForEverA / kPeakA, 2)));
  ASSERT_NEAR(heat.heat(), 1.05, 1e-9);
  EXPECT_FALSE(heat.over());
  EXPECT_DOUBLE_EQ(heat.allowed_a(kPeakA, kForEverA), kForEverA);
}

TEST(WindingHeat, TooHotNothingIsAllowedUntilItHasCooled) {
  WindingHeat heat;
  heat.advance(kPeakA, kForEverA, kTauS, 5.0);  // a command that was held without a look
  ASSERT_TRUE(heat.over());
  EXPECT_EQ(heat.allowed_a(kPeakA, kForEverA), 0.0);
  while (heat.warm()) {
    EXPECT_TRUE(heat.over());
    heat.advance(0.0, kForEverA, kTauS, 0.1);
  }
  EXPECT_FALSE(heat.over());
  EXPECT_EQ(heat.allowed_a(kPeakA, kForEverA), kPeakA);
}

}  // namespace
}  // namespace hapticd::phantom
