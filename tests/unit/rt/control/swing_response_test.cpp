#include "rt/control/swing_response.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <utility>

namespace hapticd::rt {
namespace {

constexpr double kTickS = 1e-3;

/// Feeds so many seconds of a lead that swings.
void swing(SwingResponse& response, double hz, double amplitude_n, double seconds) {
  for (int i = 0; i < static_cast<int>(std::lround(seconds / kTickS)); ++i) {
    response.update(amplitude_n * std::sin(2.0 * std::numbers::pi * hz * i * kTickS), kTickS);
  }
}

TEST(SwingResponse, ASwingFasterThanAHandTakesTheLeadUntilItIsStill) {
  SwingResponse response;
  swing(response, 25.0, 0.2, 0.2);
  EXPECT_TRUE(response.keeps_lead());
  swing(response, 25.0, 0.2, 0.2);
  EXPECT_FALSE(response.keeps_lead());
  EXPECT_TRUE(response.keeps_structure());
  response.begin();
  EXPECT_FALSE(response.keeps_lead()) << "a contact that bounces";
  swing(response, 25.0, 0.0, SwingResponse::kStillS + 0.1);
  response.begin();
  EXPECT_TRUE(response.keeps_lead());
}

TEST(SwingResponse, OneThatGoesOnTakesStructureAndGainInStepsAndSmoothly) {
  SwingResponse response;
  double before = 2.0;
  for (int i = 0; i < 100; ++i) {
    swing(response, 70.0, 0.2, 0.01);
    const double shares = response.structure_share() + response.gain_share();
    EXPECT_LE(shares, before);
    EXPECT_GE(shares, before - 2.0 * 0.01 / SwingResponse::kFadeS - 1e-9);
    before = shares;
  }
  EXPECT_EQ(response.structure_share(), 0.0);
  EXPECT_EQ(response.gain_share(), 0.25);
}

TEST(SwingResponse, WhatATargetWasTooMuchForIsBackWithTheNextOne) {
  SwingResponse response;
  swing(response, 70.0, 0.2, 0.25);
  ASSERT_FALSE(response.keeps_structure());
  swing(response, 70.0, 0.0, SwingResponse::kStillS + 0.1);
  response.begin();
  response.reset();
  EXPECT_FALSE(response.keeps_structure());
  response.retry();
  EXPECT_TRUE(response.keeps_structure());
  EXPECT_TRUE(response.keeps_lead());
  swing(response, 70.0, 0.0, 0.1);
  EXPECT_EQ(response.structure_share(), 1.0);
}

TEST(SwingResponse, AHandNoiseAndAKnockTakeNothing) {
  for (const auto& [hz, amplitude_n] : {std::pair{6.0, 1.0}, {150.0, 0.02}, {25.0, 0.04}}) {
    SwingResponse response;
    swing(response, hz, amplitude_n, 5.0);
    EXPECT_TRUE(response.keeps_lead()) << hz << " Hz, " << amplitude_n << " N";
  }
  SwingResponse knocked;
  for (int i = 0; i < 500; ++i) {
    const double t = i * kTickS;
    knocked.update(std::exp(-25.0 * t) * std::sin(2.0 * std::numbers::pi * 40.0 * t), kTickS);
  }
  EXPECT_TRUE(knocked.keeps_lead());
}

TEST(SwingResponse, ANumberThatIsNoneChangesNoShare) {
  SwingResponse response;
  for (int i = 0; i < 1000; ++i) response.update(i % 2 == 0 ? std::nan("") : 1.0, kTickS);
  response.update(0.0, kTickS);
  EXPECT_TRUE(response.structure_share() >= 0.0 && response.gain_share() >= 0.25);
}

}  // namespace
}  // namespace hapticd::rt
