#include "rt/modulation/late_onset.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstddef>
#include <vector>

namespace hapticd::rt {
namespace {

constexpr double kTickS = 1e-3;

/// What the hand feels of a spring of `object` on which one of `target` is rendered from `late_mm` on.
struct Press {
  double object = 0.3;
  double target = 0.7;
  double late_mm = 0.4;
  LateOnset late;

  double felt_n(double x_mm, double mm_per_s) {
    const double reaction_n = object * x_mm;
    if (x_mm < late_mm && !late.has_begun()) return reaction_n;
    return target * x_mm - late.update(target * x_mm, reaction_n, mm_per_s, kTickS);
  }
};

TEST(LateOnset, TheHandFeelsNoStepAndNoSteeperSlopeThanTheTargetsAndItsShare) {
  for (const double target : {0.1, 0.2, 0.5, 0.7, 1.3}) {
    Press press;
    press.target = target;
    double before_n = 0.0;
    for (double x_mm = 0.0; x_mm < 8.0; x_mm += 0.02) {
      const double felt_n = press.felt_n(x_mm, 20.0);
      const double slope = (felt_n - before_n) / 0.02;
      if (x_mm > 0.0) {
        const double most = (1.0 + LateOnset::kFadeShare) * target;
        EXPECT_LE(slope, std::max(press.object, most) + 1e-9) << target << " at " << x_mm;
      }
      before_n = felt_n;
    }
  }
}

TEST(LateOnset, AHoldEndsExactAndADeepPressIsExactBeforeIt) {
  Press press;
  for (double x_mm = 0.0; x_mm < 1.0; x_mm += 0.02) press.felt_n(x_mm, 20.0);
  EXPECT_GT(press.late.missing_n(), 0.03);
  for (int i = 0; i < 2000; ++i) press.felt_n(1.0, 0.0);
  EXPECT_NEAR(press.felt_n(1.0, 0.0), 0.7, 1e-3);

  Press deep;
  for (double x_mm = 0.0; x_mm < 5.0; x_mm += 0.02) deep.felt_n(x_mm, 20.0);
  EXPECT_NEAR(deep.felt_n(5.0, 20.0), 3.5, 1e-9);
}

TEST(LateOnset, ASlowPressThatTheEncodersShowStepByStepIsNotAHold) {
  constexpr double kMmPerS = 1.5;
  Press press;
  const auto slow = [&press](double x_mm) {  // at rest for 20 ms, then a step that shows as 6 mm/s
    const double in_step = std::fmod(x_mm, 0.04) / 0.04;
    return press.felt_n(x_mm, in_step > 0.75 ? 4.0 * kMmPerS : 0.0);
  };
  double x_mm = 0.0;
  double before_n = 0.0;
  for (int i = 0; x_mm < 1.2; ++i, x_mm = i * kMmPerS * kTickS) {
    const double felt_n = slow(x_mm);
    if (i % 200 != 0) continue;  // 0.3 mm
    EXPECT_LE(felt_n - before_n, (1.02 + LateOnset::kFadeShare) * 0.7 * 0.3) << x_mm;
    before_n = felt_n;
  }
}

TEST(LateOnset, OnTheWayBackNothingPullsTheHand) {
  Press press;
  double x_mm = 0.0;
  for (; x_mm < 0.8; x_mm += 0.02) press.felt_n(x_mm, 20.0);
  for (; x_mm > 0.0; x_mm -= 0.02) EXPECT_GE(press.felt_n(x_mm, -20.0), 0.0) << x_mm;
  EXPECT_NEAR(press.felt_n(0.0, -20.0), 0.0, 1e-9);
}

TEST(LateOnset, TheWayBackGivesTheHandNoMoreThanTheWayInTook) {
  Press press;
  std::vector<double> in_n;
  for (std::size_t i = 0; i <= 100; ++i) in_n.push_back(press.felt_n(0.02 * static_cast<double>(i), 20.0));
  for (std::size_t i = 100; i > 20; --i)
    EXPECT_NEAR(press.felt_n(0.02 * static_cast<double>(i), -20.0), in_n[i], 1e-12) << i;
  // If nothing was rendered on the way in, no more than the target's own force is on the way out.
  for (std::size_t i = 21; i-- > 0;)
    EXPECT_LE(press.felt_n(0.02 * static_cast<double>(i), -20.0), in_n[i] + 1e-12) << i;
}

TEST(LateOnset, WhatABoundHeldBackComesWithoutAStep) {
  Press press;
  double before_n = 0.0;
  for (double x_mm = 0.0; x_mm < 6.0; x_mm += 0.02) {
    double felt_n = press.felt_n(x_mm, 20.0);
    const double most_n = press.object * x_mm + (x_mm < 1.5 ? 0.1 : 1e9);
    if (felt_n > most_n) {
      press.late.hold_back(felt_n - most_n);
      felt_n = most_n;
    }
    EXPECT_LE(felt_n - before_n, (1.0 + LateOnset::kFadeShare) * 0.7 * 0.02 + 1e-9) << x_mm;
    before_n = felt_n;
  }
}

TEST(LateOnset, TheShareThatIsRenderedMakesNoStepOnTheWayInAndOut) {
  Press press;
  press.felt_n(press.late_mm, 20.0);
  double before = press.late.rendered_share();
  EXPECT_NEAR(before, press.object / press.target, 1e-12) << "of the target the hand feels what it felt";
  const auto look = [&](double x_mm, double mm_per_s) {
    press.felt_n(x_mm, mm_per_s);
    const double now = press.late.rendered_share();
    EXPECT_NEAR(now, before, 0.05) << x_mm;
    before = now;
  };
  for (double x_mm = press.late_mm; x_mm < 5.0; x_mm += 0.01) look(x_mm, 20.0);
  EXPECT_EQ(before, 1.0);
  for (double x_mm = 5.0; x_mm > 0.0; x_mm -= 0.01) look(x_mm, -20.0);
  look(0.0, -20.0);
  EXPECT_EQ(before, 0.0);
}

TEST(LateOnset, ANewContactBeginsAnew) {
  Press press;
  for (double x_mm = 0.0; x_mm < 1.0; x_mm += 0.02) press.felt_n(x_mm, 20.0);
  press.late.reset();
  EXPECT_FALSE(press.late.has_begun());
  EXPECT_EQ(press.late.missing_n(), 0.0);
}

}  // namespace
}  // namespace hapticd::rt
