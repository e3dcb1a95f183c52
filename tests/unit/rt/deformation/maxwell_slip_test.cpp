// Maxwell-slip friction in the tick: in the plane, and tracked together with the normal.
#include "rt/friction/maxwell_slip.h"

#include <gtest/gtest.h>

#include <limits>
#include <numbers>

#include "directions.h"
#include "rt/baseline/published_direction.h"
#include "rt/deformation/friction_filter.h"
#include "rt/deformation/tracked_direction.h"
#include "tests/unit/rt/deformation/stroked_surface.h"

namespace hapticd::rt {
namespace {

using namespace test;

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

/// Sharper than an exponential: level 0.35 is reached after twice 0.36 mm, at once.
FrictionParameters sharp_rod() {
  MaxwellSlipParameters elements{.reach_mm = {0.26, 0.29, 0.32, 0.36},
                                 .stiffness_per_mm = {0.35, 0.42, 0.25, 0.15}};
  return {elements.kinetic(), elements.presliding_mm(), 2e-4, 1.0, elements};
}
/// What Dahl's law with one number of presliding makes of it.
FrictionParameters as_dahl(FrictionParameters friction) {
  friction.maxwell_slip.reset();
  return friction;
}

TEST(PlanarMaxwellSlip, AlongALineIsTheScalarLaw) {
  const MaxwellSlipParameters elements = *sharp_rod().maxwell_slip;
  MaxwellSlip line(elements);
  PlanarMaxwellSlip plane(elements);
  const hal::Vector3 normal = direction_or({0.3, -0.2, 1.0}, {});
  const hal::Vector3 along = direction_or(across({1.0, 0.4, 0.0}, normal), {});
  double last_mm = 0.0;
  for (int i = 0; i < 5000; ++i) {
    const double x = 0.8 * std::sin(0.003 * i) + 0.2 * std::sin(0.031 * i);
    const double expected = line.step(x - last_mm);
    const hal::Vector3 found = plane.step(along * (x - last_mm), normal);
    last_mm = x;
    EXPECT_NEAR(dot(found, along), expected, 1e-12);
    EXPECT_NEAR(norm(found), std::abs(expected), 1e-12);
  }
}

TEST(PlanarMaxwellSlip, NeverExceedsItsLevelAndTurnsIntoTheDirectionOfSliding) {
  const MaxwellSlipParameters elements = *sharp_rod().maxwell_slip;
  PlanarMaxwellSlip law(elements);
  std::mt19937_64 random(4);
  const hal::Vector3 up{0.0, 0.0, 1.0};
  for (int i = 0; i < 20'000; ++i) {
    const hal::Vector3 found = law.step(across(random_vector(random, i % 100 == 0 ? 50.0 : 0.2), up), up);
    EXPECT_LE(norm(found), elements.kinetic() * (1.0 + 1e-12));
    EXPECT_EQ(found.z, 0.0);
  }
  hal::Vector3 found;
  for (int i = 0; i < 1000; ++i) found = law.step({0.01, 0.0, 0.0}, up);
  EXPECT_NEAR(found.x, elements.kinetic(), 1e-9);
  EXPECT_NEAR(found.y, 0.0, 1e-3);
}

TEST(PlanarMaxwellSlip, AStepThatIsNoNumberOrEndlessMovesNothing) {
  PlanarMaxwellSlip law(*sharp_rod().maxwell_slip);
  const hal::Vector3 up{0.0, 0.0, 1.0};
  const hal::Vector3 before = law.step({0.1, 0.05, 0.0}, up);
  for (const double x : {kNan, kInfinity, -kInfinity, 1e300}) {
    const hal::Vector3 after = law.step({x, 0.0, 0.0}, up);
    EXPECT_EQ(after.x, before.x) << x;
    EXPECT_EQ(after.y, before.y) << x;
  }
  law.release();
  EXPECT_EQ(norm(law.step({}, up)), 0.0);
}

struct MaxwellErrors {
  double mean_rad = 0.0;
  double mean_friction = 0.0;  ///< over the normal force
};

/// Strokes back and forth over a plane whose friction is `truth`, by a direction that takes it for `known`,
/// at 0.25 N … 1.3 N. From the third turn on.
template <class Direction>
MaxwellErrors stroke_errors(Direction direction, const FrictionParameters& truth) {
  std::mt19937_64 random(20);
  StrokedSurface surface(truth);
  const hal::Vector3 normal = direction_or({0.2, -0.1, 1.0}, {});
  const hal::Vector3 along = direction_or(across({1.0, 0.3, 0.0}, normal), {});
  const auto path_at = [](int i) { return 3.0 * std::sin(2.0 * std::numbers::pi * 0.8e-3 * i); };
  MaxwellErrors errors;
  int counted = 0;
  for (int i = 0; i < 10'000; ++i) {
    const hal::Vector3 step = i == 0 ? hal::Vector3{} : along * (path_at(i) - path_at(i - 1));
    const double force_n = 0.8 + 0.5 * std::sin(0.002 * i);
    const hal::Vector3 felt = surface.move(step, normal, force_n) + random_vector(random, 0.003);
    if (i == 0) {
      direction.begin(felt);
    } else {
      direction.update(felt, step, step * 1000.0);
    }
    if (i < 2000) continue;
    errors.mean_rad += angle_rad(direction.normal(), normal);
    errors.mean_friction += norm(direction.friction_n() - surface.friction_n()) / force_n;
    ++counted;
  }
  errors.mean_rad /= counted;
  errors.mean_friction /= counted;
  return errors;
}

TEST(MaxwellSlipDirection, FollowsASharpTurnThatDahlsLawRoundsOff) {
  const FrictionParameters truth = sharp_rod();
  const auto published = [](const FrictionParameters& f) {
    return PublishedDirection(FrictionLaw::kDahl, f, 1000.0);
  };
  const auto tracked = [](const FrictionParameters& f) { return TrackedDirection(f, 0.003, 1000.0); };
  const MaxwellErrors p = stroke_errors(published(truth), truth);
  const MaxwellErrors p_dahl = stroke_errors(published(as_dahl(truth)), truth);
  const MaxwellErrors t = stroke_errors(tracked(truth), truth);
  const MaxwellErrors t_dahl = stroke_errors(tracked(as_dahl(truth)), truth);
  for (const auto& [name, e] :
       {std::pair{"published", p}, {"published_dahl", p_dahl}, {"tracked", t}, {"tracked_dahl", t_dahl}}) {
    RecordProperty(std::string(name) + "_deg", std::to_string(e.mean_rad / kDegree));
    RecordProperty(std::string(name) + "_friction", std::to_string(e.mean_friction));
  }
  EXPECT_LT(p.mean_rad, 0.5 * kDegree);
  EXPECT_LT(t.mean_rad, 0.5 * kDegree);
  EXPECT_LT(p.mean_rad, 0.5 * p_dahl.mean_rad);
  EXPECT_LT(p.mean_friction, 0.5 * p_dahl.mean_friction);
  EXPECT_LT(t.mean_rad, 0.5 * t_dahl.mean_rad);
}

TEST(MaxwellSlipDirection, SurvivesGapsReversalsNoLoadAndWhatIsNoNumber) {
  const FrictionParameters truth = sharp_rod();
  for (const double rate_hz : {500.0, 1000.0, 10'000.0}) {
    TrackedDirection tracked(truth, 0.003, rate_hz);
    PublishedDirection published(FrictionLaw::kDahl, truth, rate_hz);
    std::mt19937_64 random(9);
    for (int i = 0; i < 30'000; ++i) {
      const hal::Vector3 force_n =
          i % 7 == 0 ? hal::Vector3{} : random_vector(random, i % 50 == 0 ? 100.0 : 1.0);
      const hal::Vector3 step_mm = random_vector(random, i % 30 == 0 ? 30.0 : 0.05);
      const double periods = i % 91 == 0 ? 200.0 : 1.0;
      if (i % 1000 == 0) {
        tracked.begin(force_n);
        published.begin(force_n);
      }
      tracked.update(force_n, step_mm, step_mm * rate_hz, periods);
      published.update(force_n, step_mm, step_mm * rate_hz, periods);
      for (const hal::Vector3& normal : {tracked.normal(), published.normal()}) {
        ASSERT_NEAR(norm(normal), 1.0, 1e-9) << i;
      }
      // No more than sticking friction of the whole reaction, and what is viscous.
      const double viscous_n = truth.viscous_n_s_per_mm * norm(step_mm) * rate_hz;
      ASSERT_LE(norm(tracked.friction_n()), 2.6 * truth.kinetic * (norm(force_n) + 200.0) + viscous_n) << i;
      ASSERT_LE(norm(published.friction_n()), truth.kinetic * norm(force_n) + viscous_n + 1e-9) << i;
    }
  }
}

TEST(MaxwellSlipFilter, ItsVariancesStayVariances) {
  const FrictionParameters truth = sharp_rod();
  const double limit = 4.0 * truth.kinetic * truth.kinetic;
  MaxwellSlipFilter filter(truth);
  std::mt19937_64 random(11);
  const hal::Vector3 up{0.0, 0.0, 1.0};
  double normal_variance = 0.02;
  filter.begin(0.1 * truth.kinetic * truth.kinetic);
  for (int i = 0; i < 200'000; ++i) {
    const hal::Vector3 slide = across(random_vector(random, 0.05), up);
    const double path_mm = i % 3 == 0 ? 0.0 : norm(slide);
    filter.predict({slide, path_mm, 1.0}, up, 0.07 * truth.kinetic, i % 5 == 0 ? 1e-3 : 0.0);
    normal_variance += 1e-6;
    const double to_normal = normal_variance - filter.covariance();
    const double total = to_normal - filter.covariance() + filter.variance() + 1e-5;
    ASSERT_GT(total, 0.0) << i;
    const double gain = to_normal / total;
    filter.correct(across(random_vector(random, 0.01), up), up, gain, total);
    normal_variance -= gain * to_normal;
    ASSERT_GE(filter.variance(), 0.0) << i;
    ASSERT_LE(filter.variance(), limit * (1.0 + 1e-9)) << i;
    ASSERT_GE(normal_variance, 0.0) << i;
    ASSERT_LE(filter.covariance() * filter.covariance(),
              normal_variance * filter.variance() * (1.0 + 1e-6) + 1e-12)
        << i;
    ASSERT_TRUE(std::isfinite(norm(filter.coefficient()))) << i;
  }
}

}  // namespace
}  // namespace hapticd::rt
