// The candidates that estimators of hapticd are weighed against, next to their closed forms.

#include <gtest/gtest.h>

#include <cmath>

#include "rt/friction/dahl.h"
#include "tests/measure/study/precision/motion/plain_velocity.h"
#include "tests/measure/study/precision/motion/steady_state_kalman.h"
#include "tests/measure/study/precision/published_dahl.h"

namespace hapticd::study {
namespace {

constexpr double kRateHz = 1000.0;
constexpr double kPeriodS = 1.0 / kRateHz;

TEST(SteadyStateKalman, HasKalatasGains) {
  for (const double jump : {1e2, 1e4, 1e6}) {
    const double deviation_mm = 0.01;
    const double index = jump * kPeriodS * kPeriodS / deviation_mm;
    const double r = (4.0 + index - std::sqrt(8.0 * index + index * index)) / 4.0;
    const double alpha = 1.0 - r * r;
    const double beta = 2.0 * (2.0 - alpha) - 4.0 * std::sqrt(1.0 - alpha);
    const SteadyStateKalman<2> filter(deviation_mm, jump, kRateHz);
    EXPECT_NEAR(filter.gain()[0], alpha, 1e-6 * alpha) << jump;
    EXPECT_NEAR(filter.gain()[1], beta * kRateHz, 1e-6 * beta * kRateHz) << jump;
  }
}

TEST(SteadyStateKalman, KeepsTheRelationOfTheThreeGains) {
  // K = (α, β/T, γ/2T²) with γ = β²/α (Kalata 1984).
  for (const double jump : {1e2, 1e3, 1e5}) {
    const SteadyStateKalman<3> filter(0.01, jump, kRateHz);
    const double alpha = filter.gain()[0];
    const double beta = filter.gain()[1] * kPeriodS;
    const double gamma = 2.0 * filter.gain()[2] * kPeriodS * kPeriodS;
    EXPECT_NEAR(gamma, beta * beta / alpha, 1e-6 * gamma) << jump;
  }
}

TEST(SteadyStateKalman, FollowsWhatItReckonsWithWithoutLag) {
  SteadyStateKalman<2> line(0.01, 1e4, kRateHz);
  SteadyStateKalman<3> parabola(0.01, 1e3, kRateHz);
  for (int k = 0; k < 2000; ++k) {
    const double t = k * kPeriodS;
    line.update(300.0 * t);
    parabola.update(300.0 * t + 500.0 * t * t);
  }
  EXPECT_NEAR(line.velocity_mm_per_s(), 300.0, 1e-6);
  EXPECT_NEAR(parabola.velocity_mm_per_s(), 300.0 + 1000.0 * 1.999, 1e-3);
  EXPECT_NEAR(parabola.acceleration_mm_per_s2(), 1000.0, 1.0);
}

TEST(PlainVelocity, OfALineIsItsSlope) {
  PlainDifference difference(kRateHz);
  FilteredDifference filtered(50.0, kRateHz);
  double of_difference = 0.0, of_filtered = 0.0;
  for (int k = 0; k < 1000; ++k) {
    const double position_mm = 0.2 * k;
    of_difference = difference.update(position_mm);
    of_filtered = filtered.update(position_mm);
  }
  EXPECT_NEAR(of_difference, 200.0, 1e-9);
  EXPECT_NEAR(of_filtered, 200.0, 1e-6);
}

TEST(EulerDahl, ApproachesTheExactStepAndDivergesBeyondTwo) {
  constexpr double kStiffness = 5.0;
  constexpr double kCoulombN = 1.0;
  EulerDahl fine(kStiffness);
  EulerDahl coarse(kStiffness);
  double z = 0.0;
  double of_fine = 0.0;
  double of_coarse = 0.0;
  for (int k = 0; k < 300; ++k) {
    of_fine = fine.step(1e-3, kCoulombN);
    of_coarse = coarse.step(0.5, kCoulombN);  // σ Δx / f_c = 2.5
    z = rt::dahl_step(z, 1e-3, kCoulombN / kStiffness);
  }
  EXPECT_NEAR(of_fine, kCoulombN * z, 2e-3);
  EXPECT_GT(std::abs(of_coarse), 1e6);
}

TEST(PublishedDahl, CountsTheWaySinceTheTurnAgainAndAgain) {
  constexpr double kStiffness = 5.0;
  constexpr double kCoulombN = 1.0;
  PublishedDahl published(kStiffness);
  double z = 0.0;
  double force_n = published.step(0.01, 100.0, kCoulombN);
  z = rt::dahl_step(z, 0.01, kCoulombN / kStiffness);
  EXPECT_NEAR(force_n, kCoulombN * z, 1e-12);  // the first step is the exact one
  for (int k = 2; k <= 10; ++k) {
    force_n = published.step(0.01, 100.0, kCoulombN);
    z = rt::dahl_step(z, 0.01, kCoulombN / kStiffness);
  }
  // Σ k = 55 steps' worth of way instead of 10.
  EXPECT_NEAR(force_n, 1.0 - std::exp(-55.0 * 0.01 * kStiffness), 1e-9);
  EXPECT_GT(force_n, 1.5 * kCoulombN * z);
}

}  // namespace
}  // namespace hapticd::study
