// Nearest points of undeformed surfaces, by search and by geometry.

#include "hal/sim/object/shape.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include "hal/sim/base/random.h"
#include "hal/sim/object/object_model.h"
#include "tests/unit/sim/virtual_rig.h"

namespace hapticd::sim {
namespace {

using hal::Vector3;
using test::length;

double height_mm(const WavyField& field, double x, double y) {
  const double k = 2.0 * std::numbers::pi / field.wavelength_mm;
  return field.amplitude_mm * (std::cos(k * x) * std::cos(k * y) - 1.0);
}

double radius_of_curvature_mm(const WavyField& field) {
  const double k = 2.0 * std::numbers::pi / field.wavelength_mm;
  return 1.0 / (field.amplitude_mm * k * k);
}

/// Distance to the field by search: a grid over the neighbourhood, then ever finer ones around the best.
double searched_distance_mm(const WavyField& field, const Vector3& p) {
  double best = 1e300, bx = p.x, by = p.y;
  double half = 0.6 * field.wavelength_mm;
  for (int round = 0; round < 10; ++round) {
    const double cx = bx, cy = by;
    constexpr int kHalfCells = 12;
    for (int i = -kHalfCells; i <= kHalfCells; ++i) {
      for (int j = -kHalfCells; j <= kHalfCells; ++j) {
        const double x = cx + half * i / kHalfCells, y = cy + half * j / kHalfCells;
        const double d = length(Vector3{x, y, height_mm(field, x, y)} - p);
        if (d < best) {
          best = d;
          bx = x;
          by = y;
        }
      }
    }
    half *= 0.2;
  }
  return best;
}

const WavyField kWavyFields[] = {{1.5, 45.0}, {2.0, 80.0}, {2.0, 40.0}};

TEST(Plane, DepthIsBelowZero) {
  const Projection nearest = Plane{}.project({3.0, -4.0, -1.5});
  EXPECT_EQ(nearest.depth_mm, 1.5);
  EXPECT_EQ(length(nearest.point_mm - Vector3{3.0, -4.0, 0.0}), 0.0);
  EXPECT_EQ(nearest.outward_normal.z, 1.0);
  EXPECT_EQ(Plane{}.project({0.0, 0.0, 2.0}).depth_mm, -2.0);
}

TEST(Sphere, NearestPointLiesOnTheRay) {
  const Sphere sphere{35.0};
  const Vector3 centre{0.0, 0.0, -35.0};
  Random random(1);
  for (int i = 0; i < 1000; ++i) {
    const Vector3 p =
        centre + Vector3{random.normal() * 20.0, random.normal() * 20.0, random.normal() * 20.0};
    const Projection nearest = sphere.project(p);
    EXPECT_NEAR(length(nearest.point_mm - centre), 35.0, 1e-12 * 35.0) << "on the surface";
    EXPECT_NEAR(length(nearest.outward_normal), 1.0, 1e-14);
    EXPECT_NEAR(nearest.depth_mm, 35.0 - length(p - centre), 1e-12 * 35.0);
    EXPECT_LT(length(p + nearest.outward_normal * nearest.depth_mm - nearest.point_mm), 1e-11);
    EXPECT_GT(dot(nearest.outward_normal, p - centre), 0.0);
  }
}

TEST(Sphere, ItsCentreHasADepthAndANormal) {
  const Projection nearest = Sphere{40.0}.project({0.0, 0.0, -40.0});
  EXPECT_EQ(nearest.depth_mm, 40.0);
  EXPECT_EQ(length(nearest.outward_normal), 1.0);
  EXPECT_EQ(length(nearest.point_mm - Vector3{0.0, 0.0, -40.0}), 40.0);
}

/// Position on the field plus `out_mm` along its upward normal.
Vector3 off_surface(const WavyField& field, double x, double y, double out_mm) {
  constexpr double kH = 1e-5;
  const double hx = (height_mm(field, x + kH, y) - height_mm(field, x - kH, y)) / (2.0 * kH);
  const double hy = (height_mm(field, x, y + kH) - height_mm(field, x, y - kH)) / (2.0 * kH);
  const double norm = std::sqrt(1.0 + hx * hx + hy * hy);
  return Vector3{x, y, height_mm(field, x, y)} + Vector3{-hx, -hy, 1.0} * (out_mm / norm);
}

TEST(WavyField, NothingIsNearerThanTheNearestPoint) {
  Random random(2);
  for (const WavyField& field : kWavyFields) {
    const double reach_mm = 0.8 * radius_of_curvature_mm(field);
    for (int i = 0; i < 60; ++i) {
      const Vector3 p = off_surface(field, (random.uniform() - 0.5) * 3.0 * field.wavelength_mm,
                                    (random.uniform() - 0.5) * 3.0 * field.wavelength_mm,
                                    (2.0 * random.uniform() - 1.0) * reach_mm);
      const double searched_mm = searched_distance_mm(field, p);
      EXPECT_NEAR(std::abs(field.project(p).depth_mm), searched_mm, 1e-6)
          << field.wavelength_mm << ": " << p.x << " " << p.y << " " << p.z;
    }
  }
}

TEST(WavyField, NormalIsOrthogonalAndLeadsBackToTheTip) {
  Random random(3);
  for (const WavyField& field : kWavyFields) {
    const double reach_mm = 0.8 * radius_of_curvature_mm(field);
    for (int i = 0; i < 500; ++i) {
      const double out_mm = (2.0 * random.uniform() - 1.0) * reach_mm;
      const Vector3 p =
          off_surface(field, (random.uniform() - 0.5) * 150.0, (random.uniform() - 0.5) * 150.0, out_mm);
      const Projection nearest = field.project(p);
      const double x = nearest.point_mm.x, y = nearest.point_mm.y;
      EXPECT_NEAR(nearest.point_mm.z, height_mm(field, x, y), 1e-9);
      constexpr double kH = 1e-4;
      const Vector3 along_x{2.0 * kH, 0.0, height_mm(field, x + kH, y) - height_mm(field, x - kH, y)};
      const Vector3 along_y{0.0, 2.0 * kH, height_mm(field, x, y + kH) - height_mm(field, x, y - kH)};
      EXPECT_NEAR(dot(nearest.outward_normal, along_x) / (2.0 * kH), 0.0, 1e-8);
      EXPECT_NEAR(dot(nearest.outward_normal, along_y) / (2.0 * kH), 0.0, 1e-8);
      EXPECT_GT(nearest.outward_normal.z, 0.0);
      EXPECT_NEAR(length(nearest.outward_normal), 1.0, 1e-12);
      EXPECT_LT(length(p + nearest.outward_normal * nearest.depth_mm - nearest.point_mm), 1e-8);
      EXPECT_NEAR(nearest.depth_mm, -out_mm, 1e-8) << "positive inside";
    }
  }
}

TEST(WavyField, CrestsDipsAndFlanksAreWhereTheCosinesSay) {
  const WavyField field{2.0, 40.0};
  const Projection crest = field.project({40.0, -40.0, -3.0});
  EXPECT_NEAR(crest.depth_mm, 3.0, 1e-12);
  EXPECT_NEAR(crest.outward_normal.z, 1.0, 1e-12);
  const Projection dip = field.project({20.0, 0.0, -7.0});
  EXPECT_NEAR(dip.depth_mm, 3.0, 1e-12) << "4 mm below the crests";
  EXPECT_NEAR(dip.outward_normal.z, 1.0, 1e-12);
  // Half-way down along x the slope is the steepest there is, a·k.
  const Projection flank = field.project({10.0, 0.0, -2.0});
  const double slope = 2.0 * 2.0 * std::numbers::pi / 40.0;
  EXPECT_NEAR(flank.depth_mm, 0.0, 1e-12);
  EXPECT_NEAR(flank.outward_normal.x / flank.outward_normal.z, slope, 1e-9);
}

/// Points along the ridge's profile, dense in the round and on both faces.
std::vector<Vector3> ridge_profile(const Ridge& ridge, double y) {
  std::vector<Vector3> profile;
  const double r = ridge.radius_mm;
  for (int i = -5000; i <= 5000; ++i) {
    const double angle = 0.25 * std::numbers::pi * i / 5000.0;  // from the vertical
    profile.push_back({r * std::sin(angle), y, r * (std::cos(angle) - 1.0)});
    const double far_mm = 60.0 * std::abs(i) / 5000.0;
    const double x = (i < 0 ? -1.0 : 1.0) * (r * std::sin(0.25 * std::numbers::pi) + far_mm);
    profile.push_back({x, y, r * (std::cos(0.25 * std::numbers::pi) - 1.0) - far_mm});
  }
  return profile;
}

TEST(Ridge, NothingIsNearerThanTheNearestPoint) {
  const Ridge ridge{3.0};
  Random random(4);
  for (int i = 0; i < 1000; ++i) {
    const Vector3 p{40.0 * (random.uniform() - 0.5), 40.0 * (random.uniform() - 0.5),
                    40.0 * (random.uniform() - 0.5)};
    double searched_mm = 1e300;
    for (const Vector3& q : ridge_profile(ridge, p.y)) searched_mm = std::min(searched_mm, length(q - p));
    const Projection nearest = ridge.project(p);
    // Neighbours on the searched profile are 0.017 mm apart.
    EXPECT_NEAR(std::abs(nearest.depth_mm), searched_mm, 0.0085) << p.x << " " << p.y << " " << p.z;
    EXPECT_LE(std::abs(nearest.depth_mm), searched_mm + 1e-9);
    EXPECT_NEAR(length(nearest.outward_normal), 1.0, 1e-12);
    EXPECT_EQ(nearest.point_mm.y, p.y);
    EXPECT_LT(length(p + nearest.outward_normal * nearest.depth_mm - nearest.point_mm), 1e-9);
    // The surface as a height over x distinguishes inside from outside.
    const double x = std::abs(p.x), edge = 3.0 * std::sqrt(0.5);
    const double height = x < edge ? std::sqrt(9.0 - x * x) - 3.0 : 2.0 * edge - 3.0 - x;
    EXPECT_EQ(nearest.depth_mm > 0.0, p.z < height) << p.x << " " << p.z;
  }
}

TEST(Ridge, CrestFacesAndTheSeamBetweenThem) {
  const Ridge ridge{3.0};
  EXPECT_EQ(ridge.project({0.0, 7.0, 0.0}).depth_mm, 0.0);
  EXPECT_EQ(ridge.project({0.0, 7.0, -2.0}).depth_mm, 2.0);
  EXPECT_EQ(ridge.project({0.0, 7.0, -2.0}).outward_normal.z, 1.0);
  // The faces are at right angles to each other.
  const Projection right = ridge.project({20.0, 0.0, -10.0});
  const Projection left = ridge.project({-20.0, 0.0, -10.0});
  EXPECT_NEAR(dot(right.outward_normal, left.outward_normal), 0.0, 1e-12);
  EXPECT_GT(right.outward_normal.x, 0.0);
  EXPECT_EQ(left.depth_mm, right.depth_mm);
  // Beyond the end of the round, depth and normal go on without a step.
  for (const double out_mm : {-2.0, 0.0, 5.0}) {
    const double x = (3.0 + out_mm) * std::sqrt(0.5), z = x - 3.0;
    const Projection round = ridge.project({x - 1e-9, 0.0, z + 1e-9});
    const Projection face = ridge.project({x + 1e-9, 0.0, z - 1e-9});
    EXPECT_NEAR(round.depth_mm, face.depth_mm, 1e-8);
    EXPECT_LT(length(round.outward_normal - face.outward_normal), 1e-8);
  }
  // Deeper than the radius the nearest point changes sides, the depth does not jump.
  const Projection one = ridge.project({-1e-9, 0.0, -8.0}), other = ridge.project({1e-9, 0.0, -8.0});
  EXPECT_NEAR(one.depth_mm, other.depth_mm, 1e-8);
  EXPECT_LT(one.outward_normal.x, -0.7);
  EXPECT_GT(other.outward_normal.x, 0.7);
  const Projection centre = ridge.project({0.0, 0.0, -3.0});
  EXPECT_NEAR(centre.depth_mm, 3.0, 1e-12);
  EXPECT_NEAR(length(centre.outward_normal), 1.0, 1e-12);
}

TEST(Shape, FreeSpaceIsNeverInside) {
  // Wherever a hand may carry the tip, farther from the surface than its curvature allows a unique answer.
  for (const std::string& name : object_preset_names()) {
    const ObjectModel object = *object_preset(name);
    for (double x = -75.0; x <= 75.0; x += 1.5) {
      for (double y = -75.0; y <= 75.0; y += 6.3) {
        for (double z = 0.05; z < 90.0; z = 1.4 * z + 0.5) {
          const Projection nearest = project(object.shape, {x, y, z});
          ASSERT_LT(nearest.depth_mm, 0.0) << name << ": " << x << " " << y << " " << z;
          ASSERT_TRUE(finite(nearest.point_mm) && finite(nearest.outward_normal));
          ASSERT_NEAR(length(nearest.outward_normal), 1.0, 1e-9);
        }
      }
    }
  }
}

}  // namespace
}  // namespace hapticd::sim
