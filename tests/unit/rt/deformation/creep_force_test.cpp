#include "tests/reference/creep_force.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

namespace hapticd::rt {
namespace {

using identification::CreepForce;

/// An object that stiffens: the curve flattens towards its end.
CreepParameters stiffening(std::array<double, CreepParameters::kLags + 1> weight) {
  CreepParameters law{.weight = weight, .max_force_n = 150.0};
  for (std::size_t j = 0; j < CreepParameters::kKnots; ++j) {
    const double share = static_cast<double>(j) / (CreepParameters::kKnots - 1);
    law.displacement_mm[j] = 20.0 * std::pow(share, 0.9);
  }
  return law;
}
const CreepParameters kElastic = stiffening({1.0, 0.0, 0.0, 0.0, 0.0});
const CreepParameters kCreeping = stiffening({0.5, 0.2, 0.1, 0.1, 0.1});

TEST(CreepForce, UndoesTheLawSampleBySample) {
  for (const CreepParameters& parameters : {kElastic, kCreeping}) {
    CreepLaw law(parameters, 1000.0);
    CreepForce inverse(parameters);
    for (int i = 0; i < 20'000; ++i) {
      const double force_n = 90.0 * (1.0 - std::cos(3e-4 * i)) + 1.0;  // and beyond the last knot
      const double x = law.update(force_n).displacement_mm;
      ASSERT_NEAR(inverse.update(x, 1e-3), force_n, 1e-8 * (1.0 + force_n)) << i;
    }
  }
}

TEST(CreepForce, RisesWithTheDisplacementAndIsAStraightLineBeyondTheLastKnot) {
  const CreepForce inverse(kElastic);
  double last_n = 0.0;
  for (double x = 0.0; x < 40.0; x += 0.01) {
    const double force_n = inverse.effective_force_n(x);
    ASSERT_GE(force_n, last_n);
    last_n = force_n;
  }
  const double at_20 = inverse.effective_force_n(20.0);
  EXPECT_NEAR(at_20, 150.0, 1e-9);
  const double first_mm = inverse.effective_force_n(21.0) - at_20;
  EXPECT_NEAR(inverse.effective_force_n(30.0) - inverse.effective_force_n(29.0), first_mm, 1e-9);
  const CreepLaw law(kElastic, 1000.0);
  EXPECT_NEAR(law.curve(inverse.effective_force_n(33.0)).displacement_mm, 33.0, 1e-9);
}

TEST(CreepForce, IsFiniteAndNeverNegativeForAnyInput) {
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
  for (const CreepParameters& parameters : {kElastic, kCreeping}) {
    CreepForce inverse(parameters);
    EXPECT_EQ(inverse.update(0.0, 1e-3), 0.0);
    for (const double x : {-5.0, kNaN, 0.0, 3.0, 1e300, kInfinity, -kInfinity, 3.0}) {
      for (const double step_s : {1e-3, 0.0, -1.0, kNaN, 1e9}) {
        const double force_n = inverse.update(x, step_s);
        ASSERT_TRUE(std::isfinite(force_n)) << x << " " << step_s;
        ASSERT_GE(force_n, 0.0) << x << " " << step_s;
      }
    }
  }
}

TEST(CreepLaw, WhatIsNoNumberCountsAsNoForceAndIsForgottenAtOnce) {
  CreepLaw law(kElastic, 1000.0);
  EXPECT_EQ(law.update(std::numeric_limits<double>::quiet_NaN()).displacement_mm, 0.0);
  EXPECT_GT(law.update(10.0).displacement_mm, 0.0);
  EXPECT_EQ(law.update(0.0).displacement_mm, 0.0) << "an elastic curve keeps nothing";
}

}  // namespace
}  // namespace hapticd::rt
