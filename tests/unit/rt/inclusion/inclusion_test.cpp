// A virtual inclusion: the law along l_0, off it, past it; what it never does.

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "rt/inclusion/rendered_inclusions.h"
#include "rt/signal/vector.h"

namespace hapticd::rt {
namespace {

using hal::Vector3;

/// 25 mm below the origin of a plane surface z = 0.
InclusionParameters below_origin() {
  InclusionParameters inclusion;
  inclusion.place_mm = {0.0, 0.0, -25.0};
  inclusion.response = {0.02, 1e-5, 2.3};
  inclusion.max_displacement_mm = 15.0;
  return inclusion;
}

Indentation pressed(double x_mm, double y_mm, double depth_mm) {
  return {{x_mm, y_mm, -depth_mm}, {0.0, 0.0, 1.0}, depth_mm, 0.0};
}

TEST(Inclusion, OnItsLineTheForceIsTheIdentifiedOne) {
  const InclusionParameters inclusion = below_origin();
  for (const double depth : {0.5, 3.0, 10.0, 14.9}) {
    Indentation at = pressed(0.0, 0.0, depth);
    at.rate_mm_per_s = 40.0;
    const double expected = hunt_crossley_force_n(inclusion.response, depth, 40.0);
    for (const Vector3& force : {energy_force_n(inclusion, at), published_force_n(inclusion, at)}) {
      EXPECT_NEAR(force.z, expected, 1e-9 * expected + 1e-12) << depth;
      EXPECT_NEAR(std::hypot(force.x, force.y), 0.0, 1e-12);
    }
  }
}

TEST(Inclusion, ForceIsTheGradientOfItsEnergy) {
  const InclusionParameters inclusion = below_origin();
  const auto energy = [&](double x, double y, double depth) {
    return response_at(inclusion, depth).energy_n_mm * share_at(inclusion, pressed(x, y, depth)).value;
  };
  constexpr double kStepMm = 1e-4;
  for (const double x : {0.0, 4.0, 10.0, 20.0}) {
    for (const double depth : {2.0, 8.0, 14.0, 19.0}) {
      const Vector3 force = energy_force_n(inclusion, pressed(x, 3.0, depth));
      EXPECT_NEAR(force.x,
                  -(energy(x + kStepMm, 3.0, depth) - energy(x - kStepMm, 3.0, depth)) / (2 * kStepMm), 1e-5);
      EXPECT_NEAR(force.y,
                  -(energy(x, 3.0 + kStepMm, depth) - energy(x, 3.0 - kStepMm, depth)) / (2 * kStepMm), 1e-5);
      EXPECT_NEAR(force.z,
                  (energy(x, 3.0, depth + kStepMm) - energy(x, 3.0, depth - kStepMm)) / (2 * kStepMm), 1e-5);
    }
  }
}

TEST(Inclusion, NoJumpWhereTheTipCrossesTheLine) {
  RenderedInclusions law({below_origin()});
  Vector3 before;
  double largest_n = 0.0;
  for (int i = -2000; i <= 2000; ++i) {  // 100 mm/s, a tick each
    const Vector3 force = law.update(pressed(0.01 * i, 0.0, 10.0));
    if (i > -2000) largest_n = std::max(largest_n, norm(force - before));
    before = force;
  }
  EXPECT_LT(largest_n, 0.05);
}

TEST(Inclusion, StaysBoundedWhereTheTipGoesPastIt) {
  const InclusionParameters inclusion = below_origin();
  const double bound_n = 4.0 * response_at(inclusion, inclusion.max_displacement_mm).elastic_n;
  RenderedInclusions law({inclusion});
  Vector3 before;
  for (const double offset : {0.0, 0.3, 5.0, 12.0}) {
    law.reset();
    before = {};
    for (double depth = 0.0; depth <= 80.0; depth += 0.1) {
      const Vector3 force = law.update(pressed(offset, 0.0, depth));
      ASSERT_TRUE(std::isfinite(norm(force)));
      ASSERT_LT(norm(force), bound_n) << offset << " mm off, " << depth << " mm deep";
      ASSERT_LT(norm(force - before), 0.5) << offset << " mm off, " << depth << " mm deep";
      ASSERT_GE(force.z, 0.0) << "it pulls into the object";
      before = force;
    }
  }
}

TEST(Inclusion, AddsNothingToASurfaceThatFacesAway) {
  const InclusionParameters inclusion = below_origin();
  // As after a sensor was biased under load: the reaction seems to pull, the normal points down.
  for (double height = -80.0; height <= 20.0; height += 0.5) {
    for (const double depth : {1.0, 5.0, 20.0}) {
      const Vector3 tip{0.3, 0.0, height};
      EXPECT_EQ(norm(energy_force_n(inclusion, {tip, {0.0, 0.0, -1.0}, depth, 50.0})), 0.0) << height;
      EXPECT_EQ(norm(energy_force_n(inclusion, {tip, {1.0, 0.0, 0.0}, depth, 50.0})), 0.0) << height;
    }
  }
}

TEST(Inclusion, AddsNoMoreThanOnItsLineWhereverTheSurfaceSeemsToBe) {
  const InclusionParameters inclusion = below_origin();
  for (const double tilt : {0.0, 0.3, 0.9}) {
    const Vector3 normal{std::sin(tilt), 0.0, std::cos(tilt)};
    for (double height = -60.0; height <= 30.0; height += 0.5) {
      const Indentation at{{1.0, 0.0, height}, normal, 8.0, 0.0};
      EXPECT_LE(share_at(inclusion, at).value, 1.0 + 1e-12) << height;
      const double max_n = 1.5 * response_at(inclusion, 8.0).elastic_n;
      EXPECT_LE(norm(energy_force_n(inclusion, at)), max_n) << height;
    }
  }
}

TEST(Inclusion, AClosedPathMakesNoEnergy) {
  for (const double friction : {0.0, 0.2}) {
    InclusionParameters inclusion = below_origin();
    inclusion.internal_friction = friction;
    RenderedInclusions law({inclusion});
    double work_n_mm = 0.0;
    Vector3 tip_before{12.0, 0.0, 0.0}, force_before;
    for (int i = 0; i <= 20000; ++i) {
      const double t = 2.0 * M_PI * i / 20000.0;
      const Vector3 tip{12.0 * std::cos(t), 8.0 * std::sin(2.0 * t), -5.0 * (1.0 - std::cos(t))};
      const Vector3 force = law.update({tip, {0.0, 0.0, 1.0}, -tip.z, 0.0});
      work_n_mm += 0.5 * dot(force + force_before, tip - tip_before);
      tip_before = tip;
      force_before = force;
    }
    if (friction == 0.0) {
      EXPECT_NEAR(work_n_mm, 0.0, 1e-3);
    } else {
      EXPECT_LT(work_n_mm, -0.05) << "friction takes energy";
    }
  }
}

TEST(Inclusion, RubbingMeetsInternalFriction) {
  InclusionParameters inclusion = below_origin();
  inclusion.internal_friction = 0.3;
  RenderedInclusions law({inclusion});
  const auto side_at_zero = [&](double direction) {
    law.reset();
    double force_x = 0.0;
    for (double x = -8.0; x <= 0.0; x += 0.05) force_x = law.update(pressed(direction * x, 0.0, 10.0)).x;
    return force_x;
  };
  EXPECT_LT(side_at_zero(1.0), -0.02);
  EXPECT_GT(side_at_zero(-1.0), 0.02);
}

TEST(Inclusion, TheSphereMovesByHalfTheDisplacement) {
  const Vector3 moved = movement_mm(below_origin(), pressed(0.0, 0.0, 8.0));
  EXPECT_NEAR(moved.z, -4.0, 1e-9);
  EXPECT_NEAR(std::hypot(moved.x, moved.y), 0.0, 1e-12);
  RenderedInclusions law({below_origin()});
  law.update(pressed(0.0, 0.0, 8.0));
  EXPECT_NEAR(law.strongest_place_mm().z, -29.0, 1e-9);
  law.update(pressed(0.0, 0.0, 0.0));
  EXPECT_EQ(law.strongest_place_mm().z, -25.0) << "out of contact it is back";
}

TEST(Inclusion, TwoAddUp) {
  InclusionParameters other = below_origin();
  other.place_mm.x = other.surface_mm.x = 15.0;
  RenderedInclusions both({below_origin(), other});
  const Indentation at = pressed(11.0, 0.0, 9.0);
  const Vector3 sum = energy_force_n(below_origin(), at) + energy_force_n(other, at);
  EXPECT_NEAR(norm(both.update(at) - sum), 0.0, 1e-12);
  EXPECT_EQ(both.strongest(), 1U);
}

TEST(Inclusion, ParametersOutOfRangeAreRefusedByName) {
  EXPECT_FALSE(check(below_origin(), "inclusion[0].", "scene"));
  InclusionParameters inclusion = below_origin();
  inclusion.approach = std::numeric_limits<double>::quiet_NaN();
  ASSERT_TRUE(check(inclusion, "inclusion[0].", "scene"));
  EXPECT_NE(check(inclusion, "inclusion[0].", "scene")->what.find("inclusion[0].approach"),
            std::string::npos);
  inclusion = below_origin();
  inclusion.surface_mm = inclusion.place_mm;
  EXPECT_TRUE(check(inclusion, "", ""));
}

}  // namespace
}  // namespace hapticd::rt
