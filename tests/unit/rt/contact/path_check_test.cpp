#include "rt/contact/path_check.h"

#include <gtest/gtest.h>

#include <cmath>

namespace hapticd::rt {
namespace {

constexpr double kStepMm = 0.02;  // 20 mm/s at 1 kHz

/// Goes `path_mm` (negative: outward), the law's depth changing by `share` of it; returns where it was
/// contradicted, 0 = nowhere.
double contradicted_after_mm(PathCheck& check, double path_mm, double share, double slide_per_path = 0.0) {
  const double step = std::copysign(kStepMm, path_mm);
  for (double at = step; std::abs(at) <= std::abs(path_mm); at += step) {
    check.update(step, slide_per_path * kStepMm, share * step);
    if (check.is_contradicted(0.0)) return at;
  }
  return 0.0;
}

TEST(PathCheck, AReadingThatStaysWhileTheTipGoesOnIsContradictedAfterAMillimetre) {
  PathCheck check;
  EXPECT_NEAR(contradicted_after_mm(check, 5.0, 0.0), 1.0, 0.25);
  check.begin();
  EXPECT_NEAR(contradicted_after_mm(check, -5.0, 0.0), -1.0, 0.25);
  // Also if the object was real for a while.
  check.begin();
  EXPECT_EQ(contradicted_after_mm(check, 4.0, 1.0), 0.0);
  EXPECT_EQ(contradicted_after_mm(check, -4.0, 1.0), 0.0);
  EXPECT_NEAR(contradicted_after_mm(check, -5.0, 0.0), -1.0, 0.25);
}

TEST(PathCheck, AnObjectThatIsAnotherThanItsLawIsNot) {
  for (const double share : {0.4, 1.0, 4.0, 50.0}) {
    PathCheck check;
    for (int press = 0; press < 20; ++press) {
      EXPECT_EQ(contradicted_after_mm(check, 20.0, share), 0.0) << share;
      EXPECT_EQ(contradicted_after_mm(check, -20.0, share), 0.0) << share;
    }
  }
}

TEST(PathCheck, WhatAWrongNormalTakesForDepthIsNot) {
  PathCheck check;
  EXPECT_EQ(contradicted_after_mm(check, 8.0, 0.0, 12.0), 0.0) << "100 mm of stroke, off by 5 degrees";
  EXPECT_NE(contradicted_after_mm(check, 8.0, 0.0, 2.0), 0.0);
}

}  // namespace
}  // namespace hapticd::rt
