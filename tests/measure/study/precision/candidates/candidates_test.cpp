// The candidates that estimators of hapticd are weighed against, and how all of them are judged, on cases
// whose answer is known.

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "rt/friction/dahl.h"
#include "tests/measure/study/precision/detection/detection_traces.h"
#include "tests/measure/study/precision/motion/motion_traces.h"
#include "tests/measure/study/precision/motion/steady_state_kalman.h"
#include "tests/measure/study/precision/published_dahl.h"

namespace hapticd::study {
namespace {

constexpr double kRateHz = 1000.0;
constexpr double kPeriodS = 1.0 / kRateHz;

TEST(SteadyStateKalman, KeepsTheRelationOfTheThreeGains) {
  // K = (α, β/T, γ/2T²) with γ = β²/α (Kalata 1984).
  for (const double jump : {1e2, 1e3, 1e5}) {
    const SteadyStateKalman filter(0.01, jump, kRateHz);
    const double alpha = filter.gain()[0];
    const double beta = filter.gain()[1] * kPeriodS;
    const double gamma = 2.0 * filter.gain()[2] * kPeriodS * kPeriodS;
    EXPECT_NEAR(gamma, beta * beta / alpha, 1e-6 * gamma) << jump;
  }
}

TEST(SteadyStateKalman, FollowsAParabolaWithoutLag) {
  SteadyStateKalman parabola(0.01, 1e3, kRateHz);
  for (int k = 0; k < 2000; ++k) {
    const double t = k * kPeriodS;
    parabola.update(300.0 * t + 500.0 * t * t);
  }
  EXPECT_NEAR(parabola.velocity_mm_per_s(), 300.0 + 1000.0 * 1.999, 1e-3);
  EXPECT_NEAR(parabola.acceleration_mm_per_s2(), 1000.0, 1.0);
}

TEST(EulerDahl, ApproachesTheExactStepAndDivergesBeyondTwo) {
  constexpr double kStiffness = 5.0;
  constexpr double kCoulombN = 1.0;
  EulerDahl fine(kStiffness), coarse(kStiffness);
  double z = 0.0, of_fine = 0.0, of_coarse = 0.0;
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
  double force_n = published.step(0.01, 100.0, kCoulombN);
  EXPECT_NEAR(force_n, kCoulombN * rt::dahl_step(0.0, 0.01, kCoulombN / kStiffness), 1e-12);
  for (int k = 2; k <= 10; ++k) force_n = published.step(0.01, 100.0, kCoulombN);
  // Σ k = 55 steps' worth of way instead of 10.
  EXPECT_NEAR(force_n, 1.0 - std::exp(-55.0 * 0.01 * kStiffness), 1e-9);
}

TEST(MotionJudge, SaysWhatALagLeavesAndOfTheTruthNothing) {
  const auto wave = [](double time_ms) { return std::sin(2.0 * std::numbers::pi * 4e-3 * time_ms); };
  constexpr int kTicks = 3000;
  std::vector<double> truth, late, exact;
  for (int i = 0; i < 10 * kTicks; ++i) truth.push_back(wave(0.1 * i));
  for (int k = 0; k < kTicks; ++k) {
    late.push_back(wave(k - 3.4));
    exact.push_back(wave(k));
  }
  const MotionError error = judge_motion(late, truth);
  // Two sines of the same size apart by φ differ by one of 2 sin(φ/2).
  EXPECT_NEAR(error.error, 2.0 * std::sin(std::numbers::pi * 4e-3 * 3.4), 1e-3);
  EXPECT_NEAR(error.rms, error.error / std::numbers::sqrt2, 1e-3);
  EXPECT_EQ(judge_motion(exact, truth).error, 0.0);
}

TEST(MotionTraces, CarryVelocityAndAccelerationOfTheirPositions) {
  for (const MotionTrace& trace : motion_traces(1.0)) {
    ASSERT_EQ(trace.ticks(), 1000U) << trace.name;
    double travelled_mm = 0.0;
    for (std::size_t i = 0; i + 1 < trace.position_mm.size(); ++i) {
      travelled_mm += 0.5e-4 * (trace.velocity_mm_per_s[i] + trace.velocity_mm_per_s[i + 1]);
    }
    EXPECT_NEAR(travelled_mm, trace.position_mm.back() - trace.position_mm.front(), 2e-3) << trace.name;
    const std::vector<double> encoder_mm = trace.encoder_mm(0.03);
    for (std::size_t k = 0; k < trace.ticks(); ++k) {
      ASSERT_LE(std::abs(encoder_mm[k] - trace.position_mm[10 * k]), 0.015 + 1e-12) << trace.name;
    }
  }
}

TEST(TappedTrace, FindsEachStrikeOnceAndBetweenTwoTicks) {
  const TappedTrace trace = tapped_trace("foam_ball", 400.0, 3, 1);
  ASSERT_EQ(trace.strikes.size(), 3U);
  for (const Strike& strike : trace.strikes) {
    EXPECT_TRUE(trace.ticks[strike.first_tick].touches);
    EXPECT_FALSE(trace.ticks[strike.first_tick - 1].touches);
    EXPECT_GE(strike.last_tick, strike.first_tick);
    const double since_ms =
        1e-6 * static_cast<double>(trace.ticks[strike.first_tick].time_ns) - strike.began_ms;
    EXPECT_GE(since_ms, 0.0);
    EXPECT_LE(since_ms, 1.0 + 1e-3);
  }
}

}  // namespace
}  // namespace hapticd::study
