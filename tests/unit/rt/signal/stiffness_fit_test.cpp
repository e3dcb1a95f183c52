#include "rt/signal/stiffness_fit.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace hapticd::rt {
namespace {

constexpr double kNoiseN = 0.003;
constexpr double kLowestNPerMm = 0.02;
constexpr double kGrownN = 0.02;

TEST(StiffnessFit, AnObjectShowsOnceItsReactionHasGrownBeyondTheNoise) {
  std::mt19937 random(3);
  std::normal_distribution<double> noise(0.0, kNoiseN);
  for (const double n_per_mm : {0.05, 0.3, 1.0, 50.0}) {
    StiffnessFit fit;
    double x_mm = 0.0;
    while (!fit.shows_object(kNoiseN, kLowestNPerMm, kGrownN) && x_mm < 5.0) {
      x_mm += 0.02;
      fit.add(0.7 + n_per_mm * x_mm + noise(random), x_mm, 0.0);
    }
    EXPECT_LT(n_per_mm * x_mm, 0.02 + std::max(7.0 * 0.02 * n_per_mm, 0.06)) << n_per_mm << " N/mm";
    EXPECT_GE(n_per_mm * x_mm, 0.02);
  }
}

TEST(StiffnessFit, TheConstantTakesTheZeroAndTheAccelerationTheMass) {
  std::mt19937 random(5);
  std::normal_distribution<double> noise(0.0, kNoiseN);
  for (int run = 0; run < 200; ++run) {
    StiffnessFit3 fit;
    const hal::Vector3 zero{0.3 * std::sin(run), -0.2, 0.1};
    for (int i = 0; i < 400; ++i) {
      // A hand that stops: way and acceleration go together.
      const double t = 1e-3 * i;
      const double w = 20.0 + run * 0.1;
      const hal::Vector3 x = hal::Vector3{1.0, 0.5, -0.3} * (3.0 * std::sin(w * t));
      const hal::Vector3 a = x * (-w * w);
      fit.add(zero + a * 4e-6 + hal::Vector3{noise(random), noise(random), noise(random)}, x, a);
      ASSERT_FALSE(fit.shows_object(kNoiseN, kLowestNPerMm, kGrownN)) << run << ", " << i;
    }
  }
}

TEST(StiffnessFit, WhatPushesTheTipOnIsNoObject) {
  StiffnessFit fit;
  for (int i = 0; i < 100; ++i) fit.add(-0.3 * i, 0.1 * i, 0.0);
  EXPECT_FALSE(fit.shows_object(kNoiseN, kLowestNPerMm, kGrownN));
}

TEST(StiffnessFit, ATipAtRestAndAFewSamplesShowNothing) {
  StiffnessFit fit;
  EXPECT_FALSE(fit.shows_object(kNoiseN, kLowestNPerMm, kGrownN));
  for (int i = 0; i < 1000; ++i) fit.add(i < 500 ? 0.0 : 3.0, 2.0, 0.0);
  EXPECT_FALSE(fit.shows_object(kNoiseN, kLowestNPerMm, kGrownN)) << "a step at rest";
  fit.reset();
  for (int i = 0; i < 5; ++i) fit.add(1.0 * i, 1.0 * i, 0.0);
  EXPECT_FALSE(fit.shows_object(kNoiseN, kLowestNPerMm, kGrownN));
}

}  // namespace
}  // namespace hapticd::rt
