#include <gtest/gtest.h>

#include <functional>
#include <numbers>

#include "directions.h"
#include "rt/baseline/published_direction.h"
#include "rt/deformation/tracked_direction.h"
#include "tests/unit/rt/deformation/stroked_surface.h"

namespace hapticd::rt {
namespace {

using namespace test;

constexpr FrictionParameters kRod{0.35, 0.3, 2e-4};
constexpr double kDirectionNoiseN = 0.003;

PublishedDirection published(const FrictionParameters& friction = kRod) {
  return {FrictionLaw::kDahl, friction, 1000.0};
}
TrackedDirection tracked(const FrictionParameters& friction = kRod) {
  return {friction, kDirectionNoiseN, 1000.0};
}

struct Errors {
  double largest_rad = 0.0;
  double mean_rad = 0.0;
  double largest_friction_n = 0.0;
};

/// Strokes back and forth over a sphere (radius 0: a plane), from 0.2 s on counted.
template <class Direction>
Errors stroke(Direction direction, double radius_mm, double noise_n, const FrictionParameters& friction) {
  std::mt19937_64 random(20);
  StrokedSurface surface(friction);
  const hal::Vector3 tilt = direction_or({0.2, -0.1, 1.0}, {});
  const hal::Vector3 along = direction_or(across({1.0, 0.3, 0.0}, tilt), {});
  const auto normal_at = [&](double path_mm) {
    const double angle = radius_mm > 0.0 ? path_mm / radius_mm : 0.0;
    return tilt * std::cos(angle) + along * std::sin(angle);
  };
  const auto place_at = [&](double path_mm) {
    if (radius_mm == 0.0) return along * path_mm;
    return normal_at(path_mm) * radius_mm;
  };
  const auto path_at = [](int i) { return 12.0 * std::sin(2.0 * std::numbers::pi * 0.8e-3 * i); };  // 60 mm/s
  Errors errors;
  int counted = 0;
  constexpr int kTicks = 10'000;
  for (int i = 0; i < kTicks; ++i) {
    const hal::Vector3 step = i == 0 ? hal::Vector3{} : place_at(path_at(i)) - place_at(path_at(i - 1));
    const hal::Vector3 normal = normal_at(path_at(i));
    const double force_n = 1.0 + 0.3 * std::sin(0.002 * i);
    const hal::Vector3 felt = surface.move(step, normal, force_n) + random_vector(random, noise_n);
    if (i == 0) {
      direction.begin(felt);
    } else {
      direction.update(felt, step, step * 1000.0);
    }
    EXPECT_NEAR(norm(direction.normal()), 1.0, 1e-12);
    if (i < 200) continue;
    const double error = angle_rad(direction.normal(), normal);
    errors.largest_rad = std::max(errors.largest_rad, error);
    errors.mean_rad += error;
    errors.largest_friction_n =
        std::max(errors.largest_friction_n, norm(direction.friction_n() - surface.friction_n()));
    ++counted;
  }
  errors.mean_rad /= counted;
  return errors;
}

TEST(Direction, OfAStrokedPlaneIsFoundUnderItsFriction) {
  for (const double noise_n : {0.0, kDirectionNoiseN}) {
    const Errors p = stroke(published(), 0.0, noise_n, kRod);
    const Errors t = stroke(tracked(), 0.0, noise_n, kRod);
    EXPECT_LT(p.mean_rad, 0.5 * kDegree);
    EXPECT_LT(t.mean_rad, 0.5 * kDegree);
    EXPECT_LT(p.largest_rad, 3.0 * kDegree) << "the friction itself tilts the reaction by 19°";
    EXPECT_LT(t.largest_rad, 3.0 * kDegree);
    EXPECT_LT(t.largest_friction_n, 0.1) << "of 0.35";
  }
}

TEST(Direction, OfAStrokedSphereIsFollowed) {
  for (const double radius_mm : {30.0, 60.0}) {
    const Errors p = stroke(published(), radius_mm, kDirectionNoiseN, kRod);
    const Errors t = stroke(tracked(), radius_mm, kDirectionNoiseN, kRod);
    EXPECT_LT(p.mean_rad, 1.0 * kDegree) << radius_mm;
    EXPECT_LT(t.mean_rad, (radius_mm < 50.0 ? 2.0 : 1.0) * kDegree)
        << radius_mm << ": friction is not taken for exact";
    EXPECT_LT(p.largest_rad, 4.0 * kDegree) << radius_mm;
    EXPECT_LT(t.largest_rad, 4.0 * kDegree) << radius_mm;
  }
}

TEST(Direction, WithoutFrictionItIsTheReactions) {
  const FrictionParameters none{};
  const Errors p = stroke(published(none), 40.0, 0.0, none);
  const Errors t = stroke(tracked(none), 40.0, 0.0, none);
  EXPECT_LT(p.largest_rad, 0.5 * kDegree) << "the filter's 3 ms at 1.5 rad/s";
  EXPECT_LT(t.largest_rad, 0.5 * kDegree);
  EXPECT_EQ(p.largest_friction_n, 0.0);
  EXPECT_EQ(t.largest_friction_n, 0.0);
}

TEST(Direction, AViscousRollingTipNeedsNoModelOfTheObject) {
  const Errors p = stroke(PublishedDirection(FrictionLaw::kCoulombViscous, kBallBearingFriction, 1000.0),
                          60.0, kDirectionNoiseN, kBallBearingFriction);
  const Errors t = stroke(tracked(kBallBearingFriction), 60.0, kDirectionNoiseN, kBallBearingFriction);
  EXPECT_LT(p.mean_rad, 1.0 * kDegree);
  EXPECT_LT(t.mean_rad, 1.0 * kDegree);
}

/// A tip at rest on a surface, pressed with 1 N.
template <class Direction>
double drift_at_rest(Direction direction, int ticks) {
  std::mt19937_64 random(21);
  const hal::Vector3 normal = direction_or({0.3, 0.1, 1.0}, {});
  direction.begin(normal * 1.0);
  double largest = 0.0;
  for (int i = 0; i < ticks; ++i) {
    direction.update(normal + random_vector(random, kDirectionNoiseN), {}, {});
    largest = std::max(largest, angle_rad(direction.normal(), normal));
  }
  return largest;
}

TEST(Direction, OfAStaticPressStaysWithinTheNoise) {
  // 3 mN on each of two components of 1 N: 0.24° now and then 0.8° unfiltered.
  EXPECT_LT(drift_at_rest(published(), 60'000), 0.6 * kDegree);
  EXPECT_LT(drift_at_rest(tracked(), 60'000), 0.6 * kDegree);
}

/// Rests by the encoders while the friction passes from one side to the other over `ticks`.
template <class Direction>
double swing_while_blind(Direction direction, int ticks) {
  const hal::Vector3 normal{0.0, 0.0, 1.0};
  const hal::Vector3 along{0.06, 0.0, 0.0};
  StrokedSurface surface(kRod);
  direction.begin(normal);
  for (int i = 0; i < 1000; ++i) direction.update(surface.move(along, normal, 1.0), along, along * 1000.0);
  EXPECT_LT(angle_rad(direction.normal(), normal), 1.0 * kDegree);
  double largest = 0.0;
  for (int i = 0; i <= ticks; ++i) {
    const double share = -1.0 + 2.0 * i / ticks;
    direction.update({kRod.kinetic * share, 0.0, 1.0}, {}, {});
    largest = std::max(largest, angle_rad(direction.normal(), normal));
  }
  return largest;
}

TEST(Direction, FrictionThatTurnsWhileTheEncodersAreBlindTurnsNoTrackedNormal) {
  for (const int ticks : {50, 100, 200, 500}) {
    EXPECT_LT(swing_while_blind(tracked(), ticks), 5.0 * kDegree) << ticks;
    EXPECT_GT(swing_while_blind(published(), ticks), 25.0 * kDegree) << "as published it does";
  }
}

TEST(Direction, AStraightPressWithASlantedStartDoesNotRunAway) {
  std::mt19937_64 random(22);
  const hal::Vector3 normal{0.0, 0.0, 1.0};
  for (const double off_deg : {-8.0, 8.0, 15.0}) {
    for (const double mm_per_s : {5.0, 20.0, 100.0}) {
      TrackedDirection direction = tracked();
      const double off = off_deg * kDegree;
      direction.begin({0.05 * std::sin(off), 0.0, 0.05 * std::cos(off)});
      const hal::Vector3 step{0.0, 0.0, -1e-3 * mm_per_s};
      double largest = 0.0;
      const int ticks = static_cast<int>(8000.0 / mm_per_s);
      for (int i = 1; i <= ticks; ++i) {
        const hal::Vector3 felt = normal * (0.05 + 2.0 * i / ticks) + random_vector(random, kDirectionNoiseN);
        direction.update(felt, step, step * 1000.0);
        largest = std::max(largest, angle_rad(direction.normal(), normal));
      }
      EXPECT_LT(largest, std::abs(off) + 2.0 * kDegree) << off_deg << "° at " << mm_per_s << " mm/s";
      EXPECT_LT(angle_rad(direction.normal(), normal), 5.0 * kDegree)
          << off_deg << "° at " << mm_per_s << " mm/s";
    }
  }
}

TEST(Direction, TheReportedDeviationCoversTheErrorAndShrinksWithForce) {
  // Sliding: what the filter believes is of the size of what is wrong.
  std::mt19937_64 random(23);
  StrokedSurface surface(kRod);
  TrackedDirection direction = tracked();
  const hal::Vector3 normal{0.0, 0.0, 1.0};
  const hal::Vector3 step{0.05, 0.0, 0.0};
  direction.begin(normal * 0.3);
  const double at_first = direction.deviation_rad();
  double squared = 0.0, believed = 0.0;
  for (int i = 0; i < 5000; ++i) {
    direction.update(surface.move(step, normal, 1.0) + random_vector(random, kDirectionNoiseN), step,
                     step * 1000.0);
    if (i < 500) continue;
    squared += std::pow(angle_rad(direction.normal(), normal), 2);
    believed += std::pow(direction.deviation_rad(), 2);
  }
  EXPECT_LT(direction.deviation_rad(), at_first);
  EXPECT_LT(squared, 4.0 * believed) << "not more certain than it may be: twice its deviation at most";
}

/// Anything at all: the length stays 1, nothing is NaN, and afterwards the normal is found again.
template <class Direction>
void survive(const std::function<Direction()>& fresh) {
  std::mt19937_64 random(24);
  std::uniform_real_distribution<double> size(-9.0, 4.0);
  std::uniform_int_distribution<int> dice(0, 9);
  for (int round = 0; round < 20; ++round) {
    Direction direction = fresh();
    direction.begin(random_vector(random, std::pow(10.0, size(random))));
    for (int i = 0; i < 3000; ++i) {
      hal::Vector3 force = random_vector(random, std::pow(10.0, size(random)));
      if (dice(random) == 0) force = {};
      if (dice(random) == 1) force = direction.normal() * -std::pow(10.0, size(random));  // a flip by 180°
      if (dice(random) == 2) force = across(force, direction.normal());
      const hal::Vector3 step =
          dice(random) < 4 ? hal::Vector3{} : random_vector(random, std::pow(10.0, size(random)));
      direction.update(force, step, step * 1000.0);
      ASSERT_NEAR(norm(direction.normal()), 1.0, 1e-9) << "round " << round << ", tick " << i;
      ASSERT_TRUE(finite(direction.friction_n())) << "round " << round << ", tick " << i;
    }
    const hal::Vector3 normal = random_direction(random);
    direction.begin(normal);
    for (int i = 0; i < 500; ++i) direction.update(normal, {}, {});
    ASSERT_LT(angle_rad(direction.normal(), normal), 1.0 * kDegree);
  }
}

TEST(Direction, SurvivesAnything) {
  for (const FrictionParameters& friction :
       {kRod, FrictionParameters{}, kBallBearingFriction, FrictionParameters{5.0, 1e-3, 1.0},
        FrictionParameters{0.5, 0.1, 1e-4, 1.0, MaxwellSlipParameters{{0.05, 0.2}, {2.0, 2.0}}}}) {
    survive<PublishedDirection>([&] { return published(friction); });
    survive<TrackedDirection>([&] { return tracked(friction); });
  }
}

TEST(Direction, WithVanishingForceItKeepsTheLastNormal) {
  const hal::Vector3 normal = direction_or({0.2, 0.2, 1.0}, {});
  TrackedDirection t = tracked();
  PublishedDirection p = published();
  t.begin(normal);
  p.begin(normal);
  for (int i = 0; i < 500; ++i) {
    t.update(normal, {}, {});
    p.update(normal, {}, {});
  }
  for (int i = 0; i < 60'000; ++i) {
    t.update({}, {}, {});
    p.update({}, {}, {});
  }
  EXPECT_LT(angle_rad(t.normal(), normal), 0.1 * kDegree);
  EXPECT_LT(angle_rad(p.normal(), normal), 0.1 * kDegree);
}

/// Step of a filter that slid one way and then `path_mm` the other.
struct FilterStep {
  double before = 0.0, after = 0.0;  ///< friction coefficient around the second slide
  double covariance_kept = 0.0;      ///< covariance after over before
  double variance_before = 0.0, variance_after = 0.0;
};
FilterStep turned_filter(const FrictionParameters& friction, double path_mm, double start) {
  const hal::Vector3 up{0.0, 0.0, 1.0};
  DahlFilter filter(friction);
  filter.begin(0.01);
  filter.predict({{-0.05, 0.0, 0.0}, 0.05, 1.0}, up, 0.0, 0.0);
  filter.scale(start / filter.coefficient().x);
  FilterStep step{filter.coefficient().x, 0.0, filter.covariance(), filter.variance(), 0.0};
  filter.predict({{path_mm, 0.0, 0.0}, path_mm, 1.0}, up, 0.0, 0.0);
  step.after = filter.coefficient().x;
  step.covariance_kept = filter.covariance() / step.covariance_kept;
  step.variance_after = filter.variance();
  return step;
}

TEST(DahlFilter, PropagatesItsErrorByTheLawsOwnDerivatives) {
  constexpr double kNudge = 1e-5;
  for (const double exponent : {0.5, 0.8, 1.0, 1.5, 2.3, 3.0}) {
    for (const double path_mm : {0.002, 0.02, 0.06}) {
      for (const double relative_error : {0.0, 2.0}) {
        const auto trial = [&](double start, double presliding_share) {
          return turned_filter({0.8, 0.1 * presliding_share, 0.0, exponent, {}, relative_error}, path_mm,
                               start);
        };
        const FilterStep step = trial(-0.5, 1.0);
        const double by_start =
            (trial(-0.5 + kNudge, 1.0).after - trial(-0.5 - kNudge, 1.0).after) / (2.0 * kNudge);
        const double by_presliding =
            (trial(-0.5, 1.0 + kNudge).after - trial(-0.5, 1.0 - kNudge).after) / (2.0 * kNudge);
        EXPECT_NEAR(step.covariance_kept, by_start, 1e-6) << "exponent " << exponent << ", " << path_mm;
        const double error = std::max(DahlFilter::kMinPreslidingError, relative_error) * by_presliding;
        EXPECT_NEAR(step.variance_after, by_start * by_start * step.variance_before + error * error, 1e-6)
            << "exponent " << exponent << ", " << path_mm << " mm, ε " << relative_error;
      }
    }
  }
}

TEST(TrackedDirection, OnceSettledItTurnsNoFasterThanASurfaceCan) {
  constexpr double kFastestRadPerS = 7.0;
  for (const double rate_hz : {1000.0, 5000.0}) {
    TrackedDirection t(kRod, kDirectionNoiseN, rate_hz);
    t.begin({0.0, 0.0, 10.0});
    const int settling = static_cast<int>(0.06 * rate_hz);
    hal::Vector3 before = t.normal();
    double turned_rad = 0.0;
    for (int i = 0; i < 4 * settling; ++i) {
      // A push across the normal that comes and goes at 30 Hz while the tip slides with it.
      const double phase = std::sin(2.0 * std::numbers::pi * 30.0 * i / rate_hz);
      const hal::Vector3 velocity{100.0 * phase, 0.0, 0.0};
      t.update({-12.0 * phase, 0.0, 10.0}, velocity * (1.0 / rate_hz), velocity);
      if (i > settling) turned_rad = std::max(turned_rad, angle_rad(before, t.normal()));
      before = t.normal();
    }
    EXPECT_GT(turned_rad, 0.0) << "it does turn";
    EXPECT_LE(turned_rad, 1.01 * kFastestRadPerS * 1e-3) << "in one update, of a millisecond";
  }
}

TEST(TrackedDirection, CountsThatComeOneAxisAtATimeTellTheSameAtAnyRate) {
  // A slide down a slope; at a fast loop the encoders of x and z move in different ticks.
  const hal::Vector3 normal = direction_or({0.3, 0.0, 1.0}, {});
  const hal::Vector3 along = direction_or({1.0, 0.0, -0.3}, {});
  for (const int ticks : {2, 5, 10}) {
    TrackedDirection slow(kRod, kDirectionNoiseN, 1000.0);
    TrackedDirection fast(kRod, kDirectionNoiseN, 1000.0 * ticks);
    StrokedSurface surface(kRod);
    slow.begin(normal);
    fast.begin(normal);
    for (int i = 0; i < 2000; ++i) {
      const hal::Vector3 step = along * (i < 1000 ? 0.06 : -0.06);
      const hal::Vector3 felt = surface.move(step, normal, 1.0);
      slow.update(felt, step, step * 1000.0);
      for (int tick = 0; tick < ticks; ++tick) {
        const hal::Vector3 part{tick == 0 ? step.x : 0.0, 0.0, tick == ticks - 1 ? step.z : 0.0};
        fast.update(felt, part, step * 1000.0);
      }
      ASSERT_NEAR(angle_rad(slow.normal(), fast.normal()), 0.0, 1e-6) << ticks << " ticks, " << i << " ms";
      ASSERT_NEAR(norm(slow.friction_n() - fast.friction_n()), 0.0, 1e-6);
    }
  }
}

}  // namespace
}  // namespace hapticd::rt
