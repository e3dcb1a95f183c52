#include "rt/deformation/creep_law.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace hapticd::rt {
namespace {

CreepParameters random_law(std::mt19937_64& random) {
  std::uniform_real_distribution<double> size(-4.0, 1.0), share(0.0, 1.0);
  CreepParameters law{.max_force_n = std::pow(10.0, size(random)) * 3.0};
  for (std::size_t j = 1; j < CreepParameters::kKnots; ++j) {
    law.displacement_mm[j] = law.displacement_mm[j - 1] + std::pow(10.0, size(random));
  }
  for (double& w : law.weight) w = share(random);
  return law;
}
double knot_n(const CreepParameters& law, std::size_t j) {
  const double share = static_cast<double>(j) / (CreepParameters::kKnots - 1);
  return law.max_force_n * share * share;
}
/// What a sponge does: half at once, the rest over seconds; 8 mm at 4 N.
CreepParameters sponge() {
  CreepParameters law{.weight = {0.6, 0.1, 0.1, 0.1, 0.1}, .max_force_n = 4.0};
  for (std::size_t j = 0; j < CreepParameters::kKnots; ++j) {
    law.displacement_mm[j] = 8.0 * std::pow(knot_n(law, j) / 4.0, 0.6);
  }
  return law;
}

TEST(CreepLaw, TheCurvePassesItsKnotsRisesAndNeverOvershoots) {
  std::mt19937_64 random(10);
  for (int round = 0; round < 200; ++round) {
    const CreepParameters p = random_law(random);
    const CreepLaw law(p, 1000.0);
    for (std::size_t j = 0; j + 1 < CreepParameters::kKnots; ++j) {
      const double from = knot_n(p, j);
      const double to = knot_n(p, j + 1);
      ASSERT_NEAR(law.curve(from).displacement_mm, p.displacement_mm[j], 1e-9);
      double last = p.displacement_mm[j];
      for (int i = 1; i <= 50; ++i) {
        const LawEstimate estimate = law.curve(from + (to - from) * i / 50.0);
        ASSERT_GE(estimate.displacement_mm, last - 1e-12);
        ASSERT_LE(estimate.displacement_mm, p.displacement_mm[j + 1] + 1e-12);
        ASSERT_GE(estimate.mm_per_n, -1e-9);
        last = estimate.displacement_mm;
      }
    }
  }
}

TEST(CreepLaw, TheCurveHasNoKinkAtItsKnotsNorWhereTheLineBegins) {
  std::mt19937_64 random(11);
  for (int round = 0; round < 200; ++round) {
    const CreepParameters p = random_law(random);
    const CreepLaw law(p, 1000.0);
    for (std::size_t j = 1; j < CreepParameters::kKnots; ++j) {
      const double at = knot_n(p, j);
      const double h = 1e-9 * at;
      const double before = law.curve(at - h).mm_per_n;
      const double after = law.curve(at + h).mm_per_n;
      ASSERT_NEAR(after, before, 1e-4 * (std::abs(after) + p.displacement_mm[16] / p.max_force_n)) << j;
    }
  }
}

TEST(CreepLaw, TheSlopeOfTheCurveIsItsDerivative) {
  std::mt19937_64 random(12);
  for (int round = 0; round < 100; ++round) {
    const CreepParameters p = random_law(random);
    const CreepLaw law(p, 1000.0);
    for (double e = 0.003 * p.max_force_n; e < 1.3 * p.max_force_n; e *= 1.31) {
      const double h = 1e-6 * e;
      const double slope = (law.curve(e + h).displacement_mm - law.curve(e - h).displacement_mm) / (2.0 * h);
      ASSERT_NEAR(law.curve(e).mm_per_n, slope, 1e-3 * (slope + p.displacement_mm[16] / p.max_force_n));
    }
  }
}

TEST(CreepLaw, BeyondTheLastKnotItIsAStraightLine) {
  const CreepParameters p = sponge();
  const CreepLaw law(p, 1000.0);
  const double slope = law.curve(4.0).mm_per_n;
  EXPECT_GT(slope, 0.0);
  for (const double e : {4.0, 5.0, 40.0, 1e4}) {
    EXPECT_NEAR(law.curve(e).displacement_mm, 8.0 + slope * (e - 4.0), 1e-9 * e);
    EXPECT_EQ(law.curve(e).mm_per_n, slope);
  }
  EXPECT_EQ(law.curve(0.0).displacement_mm, 0.0);
  EXPECT_EQ(law.curve(-3.0).displacement_mm, 0.0);
  EXPECT_GT(law.curve(0.0).mm_per_n, 0.0);
}

TEST(CreepLaw, WhatCountsStaysBetweenTheExtremesOfThePast) {
  std::mt19937_64 random(13);
  for (int round = 0; round < 30; ++round) {
    const CreepParameters p = random_law(random);
    CreepLaw law(p, 1000.0);
    std::uniform_real_distribution<double> force(0.3 * p.max_force_n, 1.2 * p.max_force_n);
    for (int i = 0; i < 80'000; ++i) law.update(0.3 * p.max_force_n);  // 16 times the longest lag
    const double low = law.curve(0.2999 * p.max_force_n).displacement_mm;
    const double high = law.curve(1.2 * p.max_force_n).displacement_mm;
    for (int i = 0; i < 5000; ++i) {
      const double x = law.update(force(random)).displacement_mm;
      ASSERT_GE(x, low);
      ASSERT_LE(x, high + 1e-12);
    }
  }
}

TEST(CreepLaw, AStepSettlesOnTheCurveFromItsImmediatePart) {
  const CreepParameters p = sponge();
  CreepLaw law(p, 1000.0);
  const double first = law.update(1.0).displacement_mm;
  EXPECT_GE(first, law.curve(0.6).displacement_mm);
  EXPECT_LT(first, law.curve(0.62).displacement_mm) << "w_0 and what the 10 ms lag adds within a tick";
  double last = first;
  for (int i = 0; i < 100'000; ++i) {
    const double x = law.update(1.0).displacement_mm;
    ASSERT_GE(x, last - 1e-12) << "it yields, it does not return";
    last = x;
  }
  EXPECT_NEAR(last, law.curve(1.0).displacement_mm, 1e-7);
}

TEST(CreepLaw, ReleasedItRecoversAndIsTouchedDeeperMeanwhile) {
  CreepLaw law(sponge(), 1000.0);
  for (int i = 0; i < 3000; ++i) law.update(2.0);
  double last = law.update(0.0).displacement_mm;
  EXPECT_GT(last, 0.5) << "the surface has not come back yet";
  for (int i = 0; i < 60'000; ++i) {
    const double x = law.update(0.0).displacement_mm;
    ASSERT_LE(x, last);
    last = x;
  }
  EXPECT_LT(last, 0.005);
  for (int i = 0; i < 3000; ++i) law.update(2.0);
  law.reset();
  EXPECT_EQ(law.update(0.0).displacement_mm, 0.0) << "forgotten";
}

TEST(CreepLaw, NegativeForceCountsAsNone) {
  CreepLaw pulled(sponge(), 1000.0), left(sponge(), 1000.0);
  for (int i = 0; i < 500; ++i) {
    pulled.update(1.0);
    left.update(1.0);
  }
  for (int i = 0; i < 500; ++i) {
    ASSERT_EQ(pulled.update(-5.0).displacement_mm, left.update(0.0).displacement_mm);
  }
}

TEST(CreepLaw, UnderAHeldForceEveryRateGivesTheSame) {
  const double at_1khz[] = {0.5, 2.0, 0.0, 1.3};  // N, each held for 400 ms
  const auto run = [&](double rate_hz) {
    CreepLaw law(sponge(), rate_hz);
    std::vector<double> seen;
    const int per_2ms = static_cast<int>(std::lround(0.002 * rate_hz));
    for (const double force : at_1khz) {
      for (int i = 0; i < 200; ++i) {
        double x = 0.0;
        for (int k = 0; k < per_2ms; ++k) x = law.update(force).displacement_mm;
        seen.push_back(x);
      }
    }
    return seen;
  };
  const std::vector<double> slow = run(500.0);
  for (const double rate_hz : {1000.0, 2000.0, 5000.0, 10'000.0}) {
    const std::vector<double> fast = run(rate_hz);
    ASSERT_EQ(fast.size(), slow.size());
    for (std::size_t i = 0; i < slow.size(); ++i) ASSERT_NEAR(fast[i], slow[i], 1e-9) << rate_hz << " Hz";
  }
}

TEST(CreepLaw, TheReportedSensitivityIsWhatANewtonOfThisTickDoes) {
  CreepLaw law(sponge(), 1000.0);
  for (int i = 0; i < 2000; ++i) {
    const double f = 1.5 + std::sin(0.01 * i);
    CreepLaw more = law, less = law;
    const double h = 1e-6;
    const double slope =
        (more.update(f + h).displacement_mm - less.update(f - h).displacement_mm) / (2.0 * h);
    ASSERT_NEAR(law.update(f).mm_per_n, slope, 1e-3 * slope) << i;
  }
}

TEST(CreepLaw, WeightsAreSharesOfTheirSum) {
  CreepParameters tenfold = sponge();
  for (double& w : tenfold.weight) w *= 10.0;
  CreepLaw a(sponge(), 1000.0), b(tenfold, 1000.0);
  for (int i = 0; i < 200; ++i) {
    ASSERT_NEAR(a.update(0.02 * i).displacement_mm, b.update(0.02 * i).displacement_mm, 1e-12);
  }
}

}  // namespace
}  // namespace hapticd::rt
