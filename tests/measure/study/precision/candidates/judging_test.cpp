// How estimates and detections are judged, on cases whose answer is known.

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "tests/measure/study/precision/detection/detection_traces.h"
#include "tests/measure/study/precision/motion/motion_judge.h"
#include "tests/measure/study/precision/motion/motion_traces.h"

namespace hapticd::study {
namespace {

constexpr std::size_t kTicks = 3000;

double wave(double time_ms) {
  return std::sin(2.0 * std::numbers::pi * 4e-3 * time_ms);
}

std::vector<double> fine_wave() {
  std::vector<double> truth;
  for (std::size_t i = 0; i < 10 * kTicks; ++i) truth.push_back(wave(0.1 * static_cast<double>(i)));
  return truth;
}

TEST(MotionJudge, TellsLagFromWhatIsLeft) {
  std::vector<double> late;
  for (std::size_t k = 0; k < kTicks; ++k) late.push_back(wave(static_cast<double>(k) - 3.4));
  const MotionError error = judge_motion(late, fine_wave());
  EXPECT_NEAR(error.lag_ms, 3.4, 1e-9);
  EXPECT_NEAR(error.rest, 0.0, 1e-9);
  // Two sines of the same size apart by φ differ by one of 2 sin(φ/2).
  EXPECT_NEAR(error.error, 2.0 * std::sin(std::numbers::pi * 4e-3 * 3.4), 1e-3);
  EXPECT_NEAR(error.rms, error.error / std::numbers::sqrt2, 1e-3);
}

TEST(MotionJudge, CallsTheTruthItselfFaultless) {
  std::vector<double> exact;
  for (std::size_t k = 0; k < kTicks; ++k) exact.push_back(wave(static_cast<double>(k)));
  const MotionError error = judge_motion(exact, fine_wave());
  EXPECT_EQ(error.lag_ms, 0.0);
  EXPECT_EQ(error.error, 0.0);
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

TEST(ShakenTrace, NeverTouches) {
  for (const DetectionTick& tick : shaken_trace(0.5, 1)) ASSERT_FALSE(tick.touches);
}

}  // namespace
}  // namespace hapticd::study
