#include "tests/measure/study/precision/motion/decimation.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

namespace hapticd::study {
namespace {

std::vector<double> wave(double cycles_per_value, double amplitude, std::size_t count = 4096) {
  std::vector<double> values;
  for (std::size_t i = 0; i < count; ++i) {
    values.push_back(amplitude *
                     std::sin(2.0 * std::numbers::pi * cycles_per_value * static_cast<double>(i)));
  }
  return values;
}

TEST(DecimationLoss, IsNothingWhereEveryValueIsReported) {
  const DecimationLoss loss = decimation_loss(wave(0.01, 2.0), 1, Decimation::kPicks, 0.5);
  EXPECT_EQ(loss.rms_share, 0.0);
  EXPECT_EQ(loss.peak_share, 0.0);
}

TEST(DecimationLoss, IsNothingOnAStraightLine) {
  std::vector<double> line;
  for (int i = 0; i < 1000; ++i) line.push_back(0.1 * i);
  EXPECT_NEAR(decimation_loss(line, 7, Decimation::kPicks, 1e9).rms_share, 0.0, 1e-12);
  EXPECT_NEAR(decimation_loss(line, 7, Decimation::kMeans, 1e9).rms_share, 0.0, 1e-12);
}

TEST(DecimationLoss, OfAWaveIsThatOfStraightLinesBetweenItsValues) {
  // Linear interpolation leaves h²f''/8 at most and (ωh)²/√120 rms of a wave, to leading order.
  const double per_value = 0.001;
  const double omega_h = 2.0 * std::numbers::pi * per_value * 20.0;
  EXPECT_NEAR(decimation_loss(wave(per_value, 3.0, 20'000), 20, Decimation::kPicks, 1e9).rms_share,
              omega_h * omega_h / std::sqrt(120.0), 1e-5);
}

TEST(DecimationLoss, OfASinglePeakIsTheChanceToMissIt) {
  std::vector<double> signal(1000, 0.0);
  signal[500] = 1.0;
  const DecimationLoss loss = decimation_loss(signal, 4, Decimation::kPicks, 0.5);
  EXPECT_NEAR(loss.peak_share, 0.75, 1e-12);
  EXPECT_NEAR(loss.worst_peak_share, 1.0, 1e-12);
}

TEST(PowerBeyond, SharesTwoWavesByTheirSquares) {
  std::vector<double> both = wave(0.01, 2.0);
  const std::vector<double> fast = wave(0.2, 1.0);
  for (std::size_t i = 0; i < both.size(); ++i) both[i] += fast[i];
  EXPECT_NEAR(power_beyond(both, 0.1), 0.2, 1e-6);
  EXPECT_NEAR(power_beyond(both, 0.005), 1.0, 1e-6);
  EXPECT_NEAR(power_beyond(both, 0.5), 0.0, 1e-12);
}

}  // namespace
}  // namespace hapticd::study
