#include "rt/contact/reading_in_motion.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace hapticd::rt {
namespace {

constexpr double kTickS = 1e-3;

TEST(ReadingInMotion, AReadingThatStaysWhileTheTipMovesIsTheZerosAndIsFollowedWhileItIsTakenOver) {
  std::mt19937 random(1);
  std::normal_distribution<double> noise(0.0, 0.002);
  for (const double zero_n : {0.016, 0.05, -0.08}) {
    ReadingInMotion reading;
    double left_n = zero_n;
    double shown_at_mm = 0.0;
    for (int i = 0; i < 4000; ++i) {
      const double x_mm = 0.02 * i;
      if (!reading.update(left_n + noise(random), x_mm, kTickS)) continue;
      if (shown_at_mm == 0.0) shown_at_mm = x_mm;
      left_n -= std::copysign(std::min(std::abs(left_n), reading.kTakeOverNPerS * kTickS), left_n);
    }
    EXPECT_GE(shown_at_mm, 2.0) << zero_n;
    EXPECT_LT(shown_at_mm, 6.0) << zero_n;
    EXPECT_LT(std::abs(left_n), 1e-3) << zero_n;
  }
}

TEST(ReadingInMotion, AnObjectIsNoneHoweverSoftAndSlowlyPressed) {
  for (const double n_per_mm : {0.02, 0.1, 1.0}) {
    for (const double mm_per_s : {0.5, 5.0, 50.0}) {
      ReadingInMotion reading;
      for (double x_mm = 0.0; n_per_mm * x_mm < 0.2; x_mm += mm_per_s * kTickS) {
        ASSERT_FALSE(reading.update(0.02 + n_per_mm * x_mm, x_mm, kTickS)) << n_per_mm << ", " << mm_per_s;
      }
    }
  }
}

TEST(ReadingInMotion, AcrossItAReadingIsTheZerosOnceTheTipHasComeBack) {
  ReadingInMotion3 reading;
  const auto at = [](double z_mm) { return hal::Vector3{0.0, 0.0, z_mm}; };
  int shown_at = 0;
  for (int i = 0; i < 1000 && shown_at == 0; ++i) {
    const double z_mm = 15.0 * std::sin(0.00628 * i);  // a guided press: along z alone
    if (reading.update({0.06, 0.0, 0.0}, at(z_mm), kTickS)) shown_at = i;
  }
  EXPECT_GT(shown_at, 250) << "after the turn";
  EXPECT_LT(shown_at, 500);
  reading.reset();
  for (int i = 0; i < 1000; ++i) {  // stroked to and fro along z: its friction turns
    const double friction_n = (i / 250) % 2 == 0 ? 0.02 : -0.02;
    const double z_mm = 15.0 * std::sin(0.00628 * (i + 250));
    ASSERT_FALSE(reading.update({0.06, 0.0, friction_n}, at(z_mm), kTickS)) << i;
  }
}

TEST(ReadingInMotion, AtRestAndBeyondItsBoundNothingShows) {
  ReadingInMotion reading;
  for (int i = 0; i < 10000; ++i) EXPECT_FALSE(reading.update(0.05, 0.0, kTickS));
  for (int i = 0; i < 10000; ++i) EXPECT_FALSE(reading.update(0.12, 0.02 * i, kTickS));
  for (int i = 0; i < 1000; ++i) EXPECT_FALSE(reading.update(std::nan(""), 0.02 * i, kTickS));
}

TEST(ReadingInMotion, APressWhileTheZeroIsTakenOverEndsIt) {
  ReadingInMotion reading;
  double x_mm = 0.0;
  while (!reading.update(0.05, x_mm, kTickS)) x_mm += 0.05;
  const double from_mm = x_mm;
  bool goes_on = true;
  for (; goes_on && x_mm < from_mm + 2.0; x_mm += 0.02) {
    goes_on = reading.update(0.05 + 0.3 * (x_mm - from_mm), x_mm, kTickS);
  }
  EXPECT_LT(x_mm - from_mm, 0.1);
}

}  // namespace
}  // namespace hapticd::rt
