#include "rt/target/soft_object_bound.h"

#include <gtest/gtest.h>

#include <utility>

namespace hapticd::rt {
namespace {

/// The target after so many seconds on a linear object.
double after(SoftObjectBound& bound, double target, double object_n_per_mm, double displacement_mm,
             double seconds, double tick_s = 1e-3) {
  double rendered = target;
  for (double t = 0.0; t < seconds; t += tick_s) {
    rendered = bound.update(target, object_n_per_mm * displacement_mm, displacement_mm, tick_s);
  }
  return rendered;
}

TEST(SoftObjectBound, HoldsATargetToTwelveTimesASoftObjectSlowly) {
  for (const double tick_s : {1e-3, 16e-3}) {
    SoftObjectBound bound;
    bound.begin(1.0);
    EXPECT_GT(after(bound, 1.0, 0.05, 4.0, 0.05, tick_s), 0.85);
    EXPECT_NEAR(after(bound, 1.0, 0.05, 4.0, 2.0, tick_s), 0.6, 1e-3);
    EXPECT_EQ(after(bound, 0.4, 0.05, 4.0, 0.1, tick_s), 0.4);
  }
}

TEST(SoftObjectBound, LeavesTheSurfaceAndOrdinaryObjectsAlone) {
  for (const auto& [object, target] : {std::pair{0.1, 1.0}, {0.38, 1.0}, {0.38, 13.0}, {50.0, 1.0}}) {
    SoftObjectBound bound;
    bound.begin(0.3);
    EXPECT_EQ(after(bound, target, 0.01, SoftObjectBound::kSurfaceMm, 1.0), target);
    EXPECT_EQ(after(bound, target, object, 3.0, 1.0), target) << object;
  }
}

TEST(SoftObjectBound, FollowsAnObjectThatHardens) {
  SoftObjectBound bound;
  bound.begin(1.0);
  EXPECT_NEAR(after(bound, 1.0, 0.05, 4.0, 2.0), 0.6, 1e-3);
  EXPECT_EQ(after(bound, 1.0, 0.5, 6.0, 0.1), 1.0);
  EXPECT_NEAR(after(bound, 1.0, -0.5, 6.0, 5.0), 0.0, 1e-3) << "pulled at: nothing is made harder";
}

}  // namespace
}  // namespace hapticd::rt
