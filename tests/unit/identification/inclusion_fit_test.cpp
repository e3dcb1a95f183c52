// An inclusion from presses made here: by the law itself, with noise and a response of the object's own.

#include "server/identification/estimate/inclusion/inclusion_fit.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "hidden_inclusion.h"
#include "tests/support/value_of.h"

namespace hapticd::identification {
namespace {

using namespace test;

using hal::Vector3;

/// Presses straight down on a sphere of 60 mm whose own force is 0.08 x + 0.004 x², by a ball whose lowest
/// point is the tip.
std::vector<Press> presses(const std::vector<Vector3>& places, const rt::InclusionParameters* inclusion,
                           double ball_mm = 0.0) {
  const double reach_mm = kRadiusMm + ball_mm;
  std::mt19937 random(3);
  std::normal_distribution<double> noise(0.0, 0.01);
  std::vector<Press> all;
  for (const Vector3& place : places) {
    const double z = surface_z_mm(place.x, place.y, reach_mm);
    Press press;
    press.surface_mm = {place.x, place.y, z};
    for (int i = 1; i <= 60; ++i) {
      const double t = M_PI * i / 61.0;
      PressSample s;
      s.tip_mm = {place.x, place.y, z - 11.0 * std::sin(t)};
      s.velocity_mm_per_s = {0.0, 0.0, -40.0 * std::cos(t)};
      const Vector3 out = s.tip_mm + Vector3{0.0, 0.0, reach_mm};
      // What touches is the ball's point that is nearest to the sphere's middle.
      const Vector3 normal = out * (1.0 / rt::norm(out));
      const Vector3 touching_mm = normal * (rt::norm(out) - ball_mm) - Vector3{0.0, 0.0, kRadiusMm};
      rt::Indentation at{touching_mm, normal, reach_mm - rt::norm(out), 0.0};
      at.rate_mm_per_s = -dot(s.velocity_mm_per_s, at.normal);
      const double x = at.displacement_mm;
      s.force_n = at.normal * (0.08 * x + 0.004 * x * x);
      if (inclusion != nullptr) {
        const Vector3 added = rt::energy_force_n(*inclusion, at);
        // The tip goes farther across than the point that touches, and the work is the same.
        s.force_n = s.force_n + normal * dot(added, normal) +
                    rt::across(added, normal) * ((rt::norm(out) - ball_mm) / rt::norm(out));
      }
      s.force_n = s.force_n + Vector3{noise(random), noise(random), noise(random)};
      press.samples.push_back(s);
    }
    all.push_back(press);
  }
  return all;
}

std::vector<Vector3> grid() {
  std::vector<Vector3> places;
  for (double x = -24.0; x <= 24.0; x += 8.0)
    for (double y = -24.0; y <= 24.0; y += 8.0) places.push_back({x, y, 0.0});
  return places;
}

TEST(InclusionFit, ResponseAlongTheLineByTwoPalpations) {
  const rt::InclusionParameters truth = inclusion_at(0.0, 0.0, 25.0);
  const std::vector<Vector3> apex(4, Vector3{});
  const auto fit = value_of(fit_inclusion_response(presses(apex, nullptr), presses(apex, &truth), 25.0));
  EXPECT_TRUE(fit.converged);
  for (const double x : {3.0, 6.0, 10.0}) {
    EXPECT_NEAR(rt::hunt_crossley_force_n(fit.inclusion.response, x, 0.0) /
                    rt::hunt_crossley_force_n(truth.response, x, 0.0),
                1.0, 0.03)
        << x;
  }
  EXPECT_NEAR(fit.inclusion.place_mm.z, -25.0, 0.2);
  EXPECT_NEAR(fit.max_displacement_mm, 11.0, 0.3);
  EXPECT_GT(fit.exponent.standard_error, 0.0);
  EXPECT_LT(fit.exponent.standard_error, 0.1);
}

TEST(InclusionFit, PlaceByAScanOfOnePhantomOrTwo) {
  const rt::InclusionParameters truth = inclusion_at(6.0, -4.0, 22.0);
  for (const bool pair : {true, false}) {
    const auto fit = fit_inclusion_scan(
        pair ? presses({{0, 0, 0}, {10, 0, 0}}, nullptr) : std::vector<Press>{}, presses(grid(), &truth));
    ASSERT_TRUE(fit);
    EXPECT_NEAR(rt::norm(fit->inclusion.place_mm - truth.place_mm), 0.0, 1.0) << "pair " << pair;
    EXPECT_NEAR(fit->depth_mm.value, 22.0, 1.0);
    EXPECT_GT(fit->depth_mm.standard_error, 0.0);
    EXPECT_LT(fit->depth_mm.standard_error, 3.0);
  }
}

TEST(InclusionFit, ABallOnARoundObjectIsNotTakenForAPoint) {
  constexpr double kBallMm = 8.0;
  const rt::InclusionParameters truth = inclusion_at(6.0, -4.0, 22.0);
  const std::vector<Press> with = presses(grid(), &truth, kBallMm);
  const auto fit = value_of(fit_inclusion_scan({}, with, {}, {kBallMm, 0.0}));
  EXPECT_NEAR(fit.depth_mm.value, 22.0, 1.0);
  EXPECT_NEAR(rt::norm(fit.place_mm - truth.place_mm), 0.0, 1.0);
  // Places of the tip are as many times farther apart as its surface is larger than the body.
  const double widening = (kRadiusMm + kBallMm) / kRadiusMm;
  const auto point = value_of(fit_inclusion_scan({}, with));
  EXPECT_NEAR(point.depth_mm.value, widening * fit.depth_mm.value, 0.5);
  // Both render the same place.
  EXPECT_NEAR(rt::norm(point.inclusion.place_mm - fit.inclusion.place_mm), 0.0, 0.5);
  // What is not known of the ball is in the error.
  const auto unknown = value_of(fit_inclusion_scan({}, with, {}, {5.0, 2.9}));
  EXPECT_NEAR(unknown.depth_mm.value, 22.0, 2.0 * unknown.depth_mm.standard_error);
  EXPECT_GT(unknown.depth_mm.standard_error, 0.8);
}

TEST(InclusionFit, DisplacementsCountFromTheObjectWithoutTheInclusion) {
  // A press begins where 0.03 N are passed: sooner over the inclusion. Rendering counts from where the object
  // without it is met.
  constexpr double kThresholdN = 0.03;
  rt::InclusionParameters truth = inclusion_at(0.0, 0.0, 25.0);
  truth.response = {0.2, 2e-5, 1.5};
  const auto between = [&](const rt::InclusionParameters* inclusion) {
    std::vector<Press> all = presses(grid(), inclusion);
    for (std::size_t i = 0; i < all.size(); ++i) {
      // The samples of a press are 0.5 mm apart near the surface: where the threshold is passed is put
      // between them.
      const bool over = inclusion != nullptr;
      double x = 0.0;
      const auto force_n = [&](double depth_mm) {
        const Vector3 tip = all[i].surface_mm - Vector3{0.0, 0.0, depth_mm};
        const Vector3 out = tip + Vector3{0.0, 0.0, kRadiusMm};
        const rt::Indentation at{tip, out * (1.0 / rt::norm(out)), kRadiusMm - rt::norm(out), 0.0};
        const double d = at.displacement_mm;
        return 0.08 * d + 0.004 * d * d + (over ? rt::norm(rt::energy_force_n(*inclusion, at)) : 0.0);
      };
      while (force_n(x) < kThresholdN) x += 0.001;
      all[i].surface_mm.z -= x;
    }
    return all;
  };
  const auto fit = value_of(fit_inclusion_scan(between(nullptr), between(&truth)));
  const double late_mm = 0.368;  // 0.08 x + 0.004 x² = 0.03
  for (const double x : {4.0, 6.0, 9.0}) {
    EXPECT_NEAR(rt::hunt_crossley_force_n(fit.inclusion.response, x - late_mm, 0.0) /
                    rt::hunt_crossley_force_n(truth.response, x, 0.0),
                1.0, 0.025)
        << x;
  }
}

TEST(InclusionFit, TooLittleIsRefused) {
  EXPECT_FALSE(fit_inclusion_scan({}, {}));
  EXPECT_FALSE(fit_inclusion_response({}, presses({{0, 0, 0}}, nullptr), 25.0));
}

}  // namespace
}  // namespace hapticd::identification
