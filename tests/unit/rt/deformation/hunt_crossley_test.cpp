#include "rt/deformation/hunt_crossley.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

namespace hapticd::rt {
namespace {

/// Every exponent and stiffness a model may have, with damping B/K of 0 and 2 s/m.
std::vector<HuntCrossleyParameters> grid() {
  std::vector<HuntCrossleyParameters> laws;
  for (const double m : {1.0, 1.5, 2.0, 2.5, 3.0}) {
    for (double k = 1e-4; k < 2e3; k *= 10.0) {
      for (const double b_over_k : {0.0, 0.002}) laws.push_back({k, b_over_k * k, m});
    }
  }
  return laws;
}

std::string name(const HuntCrossleyParameters& law) {
  return "K " + std::to_string(law.stiffness_n_per_mm_m) + ", m " + std::to_string(law.exponent);
}

TEST(HuntCrossley, TheInverseUndoesTheLaw) {
  int compared = 0;
  for (const HuntCrossleyParameters& law : grid()) {
    for (const double rate : {-390.0, -200.0, -10.0, 0.0, 10.0, 200.0, 1000.0}) {
      for (double x = 1e-3; x < 50.0; x *= 1.7) {
        const double f = hunt_crossley_force_n(law, x, rate);
        if (f < 1.001e-3) continue;
        ASSERT_NEAR(hunt_crossley_displacement(law, f, rate).displacement_mm / x, 1.0, 1e-9)
            << name(law) << ", x " << x << ", rate " << rate;
        ++compared;
      }
    }
  }
  EXPECT_GT(compared, 5000);
}

TEST(HuntCrossley, AnObjectDoesNotPull) {
  const HuntCrossleyParameters law{0.3, 0.003, 1.5};
  EXPECT_EQ(hunt_crossley_force_n(law, -1.0, 0.0), 0.0);
  EXPECT_EQ(hunt_crossley_force_n(law, 0.0, 100.0), 0.0);
  EXPECT_EQ(hunt_crossley_force_n(law, 2.0, -200.0), 0.0) << "withdrawn faster than K/B = 100 mm/s";
  EXPECT_EQ(hunt_crossley_displacement(law, -1.0, 0.0).displacement_mm, 0.0);
}

TEST(HuntCrossley, FastWithdrawalCountsAsFourFifthsOfKOverB) {
  for (const HuntCrossleyParameters& law : grid()) {
    if (law.damping_n_s_per_mm_m1 == 0.0) continue;
    const double limit = -0.8 * law.stiffness_n_per_mm_m / law.damping_n_s_per_mm_m1;
    const double at_limit = hunt_crossley_displacement(law, 0.5, limit).displacement_mm;
    for (const double rate : {1.01 * limit, 2.0 * limit, -1e6}) {
      EXPECT_NEAR(hunt_crossley_displacement(law, 0.5, rate).displacement_mm, at_limit, 1e-9 * at_limit);
    }
    EXPECT_LT(hunt_crossley_displacement(law, 0.5, 0.9 * limit).displacement_mm, at_limit);
  }
}

TEST(HuntCrossley, TowardsNoForceEverythingStaysFiniteAndGoesToZero) {
  for (const HuntCrossleyParameters& law : grid()) {
    double last = HUGE_VAL;
    for (double f = 1e-2; f > 1e-300; f *= 0.1) {
      const LawEstimate estimate = hunt_crossley_displacement(law, f, 0.0);
      ASSERT_TRUE(std::isfinite(estimate.displacement_mm) && std::isfinite(estimate.mm_per_n)) << name(law);
      ASSERT_LT(estimate.displacement_mm, last) << name(law);
      ASSERT_GT(estimate.mm_per_n, 0.0);
      last = estimate.displacement_mm;
    }
    const LawEstimate none = hunt_crossley_displacement(law, 0.0, 0.0);
    EXPECT_EQ(none.displacement_mm, 0.0);
    EXPECT_TRUE(std::isfinite(none.mm_per_n));
    EXPECT_NEAR(hunt_crossley_displacement(law, 0.9999999e-3, 0.0).displacement_mm /
                    hunt_crossley_displacement(law, 1.0000001e-3, 0.0).displacement_mm,
                1.0, 1e-6)
        << "no step where the straight line takes over";
  }
}

TEST(HuntCrossley, TheSensitivityIsTheDerivative) {
  for (const HuntCrossleyParameters& law : grid()) {
    for (double f = 2e-3; f < 20.0; f *= 3.0) {
      for (const double rate : {-300.0, 0.0, 300.0}) {
        const double h = 1e-5 * f;
        const double slope = (hunt_crossley_displacement(law, f + h, rate).displacement_mm -
                              hunt_crossley_displacement(law, f - h, rate).displacement_mm) /
                             (2.0 * h);
        ASSERT_NEAR(hunt_crossley_displacement(law, f, rate).mm_per_n / slope, 1.0, 1e-6) << name(law);
      }
    }
  }
}

}  // namespace
}  // namespace hapticd::rt
