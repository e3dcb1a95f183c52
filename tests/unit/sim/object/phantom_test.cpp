// The breast phantoms: stiffness, energy, passivity.

#include <gtest/gtest.h>

#include <cmath>

#include "hal/sim/object/object_model.h"
#include "hal/sim/object/phantom_body.h"

namespace hapticd::sim {
namespace {

using hal::Vector3;

constexpr double kStepS = 1e-4;

PhantomBody body_of(const char* name) {
  return PhantomBody(*object_preset(name)->phantom, kStepS);
}

TEST(Phantom, HasTheStiffnessOfTheDissertationAt10mm) {
  for (const auto& [name, stiffness] :
       {std::pair{"phantom", 0.13}, {"phantom_hard", 0.54}, {"phantom_soft", 0.21}}) {
    for (const double speed_mm_per_s : {2.0, 10.0}) {
      PhantomBody body = body_of(name);
      double force_n = 0.0;
      for (double depth = 0.0; depth < 10.0; depth += speed_mm_per_s * kStepS)
        force_n = body.advance({0.0, 0.0, -depth}, 0.0).force_n.z;
      EXPECT_NEAR(force_n / 10.0 / stiffness, 1.0, 0.05) << name << " at " << speed_mm_per_s << " mm/s";
    }
  }
}

TEST(Phantom, ElasticForceIsTheGradientOfItsEnergy) {
  constexpr double kMm = 1e-4;
  for (const char* name : {"phantom", "phantom_hard", "phantom_soft"}) {
    const PhantomBody body = body_of(name);
    for (const Vector3& at :
         {Vector3{0.0, 0.0, -5.0}, {6.0, -3.0, -8.0}, {18.0, 4.0, -14.0}, {0.5, 0.0, -25.0}}) {
      const Vector3 force = body.elastic_force_n(at);
      const auto slope = [&](const Vector3& d) {
        return -(body.energy_n_mm(at + d * kMm) - body.energy_n_mm(at - d * kMm)) / (2.0 * kMm);
      };
      EXPECT_NEAR(force.x, slope({1.0, 0.0, 0.0}), 1e-5) << name;
      EXPECT_NEAR(force.y, slope({0.0, 1.0, 0.0}), 1e-5) << name;
      EXPECT_NEAR(force.z, slope({0.0, 0.0, 1.0}), 1e-5) << name;
    }
  }
}

TEST(Phantom, ARoundTripTakesEnergy) {
  for (const char* name : {"phantom", "phantom_hard", "phantom_soft"}) {
    for (const double seconds : {0.2, 2.0, 20.0}) {
      PhantomBody body = body_of(name);
      Vector3 before, force_before;
      double work_n_mm = 0.0;
      const int steps = static_cast<int>(seconds / kStepS);
      for (int i = 1; i <= steps; ++i) {
        const double t = 2.0 * M_PI * i / steps;
        const Vector3 tip{10.0 * std::sin(t), 5.0 * std::sin(2.0 * t), -6.0 * (1.0 - std::cos(t))};
        const Vector3 force = body.advance(tip, 0.0).force_n;
        work_n_mm += 0.5 * dot(force + force_before, tip - before);
        before = tip;
        force_before = force;
      }
      EXPECT_LT(work_n_mm, 0.0) << name << ", " << seconds << " s: it made energy";
    }
  }
}

TEST(Phantom, TheStiffSphereGivesWayAndShowsBeside) {
  const PhantomBody plain = body_of("phantom"), hard = body_of("phantom_hard");
  const Vector3 moved = hard.inclusion_mm({0.0, 0.0, -10.0});
  EXPECT_LT(moved.z, -0.5);
  EXPECT_GT(moved.z, -5.0);
  double last_n = 1e9;
  for (const double x : {0.0, 10.0, 20.0}) {
    const double surface = std::sqrt(63.0 * 63.0 - x * x) - 63.0;
    const Vector3 at{x, 0.0, surface - 10.0};
    const double more_n = hard.elastic_force_n(at).z - plain.elastic_force_n(at).z;
    EXPECT_GT(more_n, 0.0) << x;
    EXPECT_LT(more_n, last_n) << x;
    last_n = more_n;
  }
}

TEST(Phantom, LetsGoOfATipThatLeaves) {
  PhantomBody body = body_of("phantom_hard");
  for (int i = 0; i <= 1000; ++i) body.advance({0.0, 0.0, -0.01 * i}, 0.0);
  for (int i = 0; i <= 1000; ++i) {
    const Vector3 tip{0.0, 0.0, -10.0 + 0.02 * i};
    const Vector3 force = body.advance(tip, 0.0).force_n;
    EXPECT_GE(force.z, 0.0);
    if (tip.z > 0.0) {
      EXPECT_EQ(force.z, 0.0);
    }
  }
}

}  // namespace
}  // namespace hapticd::sim
