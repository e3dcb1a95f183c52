#include "rt/friction/dahl.h"

#include <cmath>
#include <limits>

#include "directions.h"

namespace hapticd::rt {
namespace {

using namespace test;

constexpr double kPreslidingMm = 0.4;

TEST(Dahl, InThePlaneTwoHalfStepsAreOneStep) {
  std::mt19937_64 random(6);
  std::uniform_real_distribution<double> share(-1.0, 1.0);
  for (int i = 0; i < 2000; ++i) {
    const hal::Vector3 v = random_direction(random) * share(random);
    const hal::Vector3 step = random_vector(random, 1.0);
    const hal::Vector3 twice = dahl_step(dahl_step(v, step * 0.5, kPreslidingMm), step * 0.5, kPreslidingMm);
    ASSERT_LT(norm(twice - dahl_step(v, step, kPreslidingMm)), 1e-14);
  }
}

/// dz/dx = |1 - s z|^i sgn(1 - s z) / δ by Runge and Kutta, stopped at full friction.
double integrated(double z, double path_mm, double exponent) {
  const double s = std::copysign(1.0, path_mm);
  constexpr int kSteps = 20'000;
  const double h = path_mm / kSteps;
  const auto slope = [&](double at) {
    const double u = 1.0 - s * at;
    return u > 0.0 ? std::pow(u, exponent) / kPreslidingMm : 0.0;
  };
  for (int i = 0; i < kSteps; ++i) {
    const double k1 = slope(z), k2 = slope(z + 0.5 * h * k1), k3 = slope(z + 0.5 * h * k2),
                 k4 = slope(z + h * k3);
    z += h / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4);
  }
  return z;
}

TEST(Dahl, WithAnExponentItIsTheExactSolution) {
  for (const double exponent : {0.0, 0.05, 0.5, 0.999999, 1.0, 1.000001, 1.5, 2.0, 3.0}) {
    for (const double path_mm : {0.01, 0.3, 2.0, -0.3, -2.0}) {
      for (const double start : {-1.0, -0.3, 0.0, 0.9}) {
        // Smooth at 1; elsewhere full friction is a kink.
        EXPECT_NEAR(dahl_step(start, path_mm, kPreslidingMm, exponent), integrated(start, path_mm, exponent),
                    exponent == 1.0 ? 1e-10 : 3e-4)
            << "i " << exponent << ", " << path_mm << " mm from " << start;
      }
    }
  }
}

TEST(Dahl, PassesThroughExponentOneWithoutAStep) {
  for (const double path_mm : {1e-9, 0.01, 0.4, 5.0}) {
    const double exact = dahl_step(-0.7, path_mm, kPreslidingMm);
    for (const double off : {1e-15, 1e-12, 1e-9, 1e-7}) {
      EXPECT_NEAR(dahl_step(-0.7, path_mm, kPreslidingMm, 1.0 + off), exact, 20.0 * off + 1e-14);
      EXPECT_NEAR(dahl_step(-0.7, path_mm, kPreslidingMm, 1.0 - off), exact, 20.0 * off + 1e-14);
    }
  }
}

TEST(Dahl, ItsSensitivityIsContinuousAtExponentOneAndEndsWhereFrictionIsFull) {
  for (const double kept : {1.0, 0.9, 0.3, 1e-6}) {
    const DahlSensitivity exact = dahl_sensitivity({kept, std::log(kept)}, 1.0);
    EXPECT_DOUBLE_EQ(exact.to_start, kept);
    EXPECT_DOUBLE_EQ(exact.to_presliding, kept == 1.0 ? 0.0 : kept * std::log(1.0 / kept));
    for (const double off : {-1e-6, -1e-10, 1e-10, 1e-6}) {
      EXPECT_NEAR(dahl_sensitivity({kept, std::log(kept)}, 1.0 + off).to_start, exact.to_start, 1e-4 * kept);
      EXPECT_NEAR(dahl_sensitivity({kept, std::log(kept)}, 1.0 + off).to_presliding, exact.to_presliding,
                  1e-4 * kept);
    }
  }
  for (const double exponent : {0.0, 0.5, 1.0, 3.0}) {
    EXPECT_EQ(dahl_sensitivity({}, exponent).to_start, 0.0) << "nothing of the start is left";
    EXPECT_EQ(dahl_sensitivity({}, exponent).to_presliding, 0.0);
  }
}

TEST(Dahl, BelowExponentOneFullFrictionIsReached) {
  // From -1 the way there is δ 2^(1-i) / (1-i).
  for (const double exponent : {0.0, 0.3, 0.8}) {
    const double whole_mm = kPreslidingMm * std::pow(2.0, 1.0 - exponent) / (1.0 - exponent);
    EXPECT_LT(dahl_step(-1.0, 0.99 * whole_mm, kPreslidingMm, exponent), 1.0);
    EXPECT_EQ(dahl_step(-1.0, 1.0001 * whole_mm, kPreslidingMm, exponent), 1.0);
    EXPECT_EQ(dahl_step(1.0, 0.1, kPreslidingMm, exponent), 1.0);
    EXPECT_EQ(dahl_step(1.0, 1e6, kPreslidingMm, exponent), 1.0);
  }
}

TEST(Dahl, WithAnyExponentStepsAddUpAndStayBounded) {
  std::mt19937_64 random(16);
  std::uniform_real_distribution<double> bend(0.0, 3.0), size(-12.0, 3.0);
  double z = 0.0;
  hal::Vector3 v;
  for (int i = 0; i < 100'000; ++i) {
    const double exponent = i % 5 == 0 ? std::round(bend(random)) : bend(random);
    const double path_mm = std::pow(10.0, size(random)) * (i % 2 == 0 ? 1.0 : -1.0);
    const double presliding_mm = i % 7 == 0 ? 0.0 : std::pow(10.0, size(random));
    const double whole = dahl_step(z, path_mm, presliding_mm, exponent);
    const double halves = dahl_step(dahl_step(z, 0.5 * path_mm, presliding_mm, exponent), 0.5 * path_mm,
                                    presliding_mm, exponent);
    ASSERT_NEAR(halves, whole, 1e-7) << "i " << exponent << ", " << path_mm << " mm, δ " << presliding_mm;
    z = whole;
    v = dahl_step(v, random_direction(random) * path_mm, presliding_mm, exponent);
    ASSERT_LE(std::abs(z), 1.0);
    ASSERT_LE(norm(v), 1.0 + 1e-12);
  }
}

TEST(Dahl, InThePlaneTheExponentMeansTheSame) {
  std::mt19937_64 random(17);
  std::normal_distribution<double> way(0.0, 0.2);
  for (const double exponent : {0.0, 0.4, 1.0, 2.0}) {
    const hal::Vector3 line = random_direction(random);
    double z = 0.0;
    hal::Vector3 v;
    for (int i = 0; i < 2000; ++i) {
      const double dx = way(random);
      z = dahl_step(z, dx, kPreslidingMm, exponent);
      v = dahl_step(v, line * dx, kPreslidingMm, exponent);
      ASSERT_LT(norm(v - line * z), exponent == 1.0 ? 1e-12 : 1e-6) << "i " << exponent;
    }
  }
}

TEST(Dahl, WithoutPreslidingItIsCoulombFriction) {
  EXPECT_EQ(dahl_step(-0.4, 1e-9, 0.0), 1.0);
  EXPECT_EQ(dahl_step(0.4, -1e-9, 0.0), -1.0);
  EXPECT_EQ(dahl_step(0.4, 0.0, 0.0), 0.4);
  double last = 0.0;
  for (const double presliding_mm : {1.0, 0.1, 0.01, 1e-3, 1e-9}) {  // and that is the limit, too
    const double z = dahl_step(-1.0, 0.02, presliding_mm);
    EXPECT_GT(z, presliding_mm == 1.0 ? -1.0 : last);
    last = z;
  }
  EXPECT_EQ(last, 1.0);
  expect_near(dahl_step(hal::Vector3{-0.4, 0.1, 0.0}, {0.0, 2.0, 0.0}, 0.0), {0.0, 1.0, 0.0}, 1e-15);
}

TEST(Dahl, NoPathGainsWork) {
  // dz/dl = (s - z)/δ gives z·s = d(δ|z|²/2)/dl + |z|²: friction stores no more than δ/2 |z|² and returns no
  // more than it stored.
  std::mt19937_64 random(9);
  for (int round = 0; round < 20; ++round) {
    hal::Vector3 z;
    double work = 0.0;
    for (int leg = 0; leg < 200; ++leg) {
      const hal::Vector3 step = random_vector(random, 0.3) * (1.0 / 200.0);
      for (int i = 0; i < 200; ++i) {
        const hal::Vector3 before = z;
        z = dahl_step(z, step, kPreslidingMm);
        work += 0.5 * dot(before + z, step);
      }
      ASSERT_GE(work, 0.5 * kPreslidingMm * dot(z, z) - 1e-6) << "leg " << leg;
    }
  }
}

TEST(Dahl, StaysBoundedThroughReversalsRestAndWhatIsNoNumberForAnyExponent) {
  constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  for (const double exponent : {0.0, 0.05, 0.5, 1.0, 2.0, 3.0}) {
    double z = 0.0;
    for (int i = 0; i < 200'000; ++i) {
      z = dahl_step(z, 0.01 * std::sin(0.37 * i) + 1e-5, 0.06, exponent);
      ASSERT_LE(std::abs(z), 1.0) << exponent;
    }
    const double before = z;
    for (int i = 0; i < 36'000'000; ++i) z = dahl_step(z, 0.0, 0.06, exponent);
    EXPECT_EQ(z, before) << "ten hours at rest";
    EXPECT_EQ(dahl_step(z, kNaN, 0.06, exponent), before);
    EXPECT_EQ(dahl_step(z, kInfinity, 0.06, exponent), 1.0);
    EXPECT_EQ(dahl_step(z, -kInfinity, 0.06, exponent), -1.0);
    const hal::Vector3 held =
        dahl_step(hal::Vector3{0.3, 0.4, 0.0}, hal::Vector3{kNaN, 0.0, 0.0}, 0.06, exponent);
    EXPECT_EQ(held.x, 0.3);
  }
}

}  // namespace
}  // namespace hapticd::rt
