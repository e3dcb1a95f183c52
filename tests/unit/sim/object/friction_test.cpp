// Friction in the tangent plane: levels, presliding, step size, energy.

#include "hal/sim/object/friction.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>

#include "hal/sim/base/random.h"
#include "hal/sim/object/object_model.h"
#include "tests/unit/sim/virtual_rig.h"

namespace hapticd::sim {
namespace {

using hal::Vector3;
using test::length;

constexpr double kStepS = 1e-4;

FrictionParameters plain() {
  return {.kinetic = 0.5,
          .static_ratio = 1.4,
          .stribeck_velocity_mm_per_s = 5.0,
          .presliding_mm = 0.1,
          .viscous_s_per_mm = 0.0};
}

/// Bristle force per newton: what a step without slide shows, without changing anything.
Vector3 bend(Friction& friction) {
  return friction.advance({}, 0.0, 1.0);
}

double steady_coefficient(const FrictionParameters& p, double velocity_mm_per_s, double step_s = kStepS) {
  Friction friction(p, step_s);
  const double slide_mm = velocity_mm_per_s * step_s;
  const int steps = 2 + static_cast<int>(50.0 * p.presliding_mm / slide_mm);
  double force_n = 0.0;
  for (int i = 0; i < steps; ++i) force_n = -friction.advance({slide_mm, 0.0, 0.0}, 0.0, 2.0).x;
  return force_n / 2.0;
}

TEST(Friction, SlidingFastItIsKineticTimesNormalForce) {
  EXPECT_NEAR(steady_coefficient(plain(), 100.0), 0.5, 1e-9);
  Friction friction(plain(), kStepS);
  for (int i = 0; i < 1000; ++i) friction.advance({0.01, 0.0, 0.0}, 0.0, 3.0);
  EXPECT_NEAR(friction.advance({0.01, 0.0, 0.0}, 0.0, 3.0).x, -1.5, 1e-9);
  EXPECT_NEAR(friction.advance({0.01, 0.0, 0.0}, 0.0, 6.0).x, -3.0, 1e-9) << "follows the load at once";
}

TEST(Friction, DropsFromStaticToKineticWithSpeed) {
  for (const double v : {0.05, 1.0, 3.0, 5.0, 8.0, 15.0, 40.0}) {
    const double expected = 0.5 * (1.0 + 0.4 * std::exp(-(v / 5.0) * (v / 5.0)));
    EXPECT_NEAR(steady_coefficient(plain(), v), expected, 1e-6) << v << " mm/s";
  }
}

TEST(Friction, ViscousPartGrowsWithSpeed) {
  FrictionParameters p = plain();
  p.viscous_s_per_mm = 2e-3;
  EXPECT_NEAR(steady_coefficient(p, 100.0), 0.5 + 0.2, 1e-9);
}

TEST(Friction, NothingWithoutNormalForce) {
  Friction friction(plain(), kStepS);
  for (int i = 0; i < 100; ++i) EXPECT_EQ(length(friction.advance({0.05, -0.02, 0.0}, 1e-4, 0.0)), 0.0);
}

TEST(Friction, BristlesBendElasticallyBelowBreakaway) {
  Friction friction(plain(), kStepS);
  // Stiffness per newton is μ/presliding; half-way to the kinetic level and back leaves nothing.
  for (int i = 0; i < 50; ++i) friction.advance({1e-3, 0.0, 0.0}, 0.0, 1.0);
  EXPECT_NEAR(bend(friction).x, -0.5 * 0.05 / 0.1, 1e-12);
  for (int i = 0; i < 50; ++i) friction.advance({-1e-3, 0.0, 0.0}, 0.0, 1.0);
  EXPECT_NEAR(bend(friction).x, 0.0, 1e-12);
}

TEST(Friction, VibrationUnderLoadDoesNotDrift) {
  // A tip on its bristles, pulled with half of what breaks it away and shaken: after any number of whole
  // cycles it is where it was. Massless, so that the bristles' balance alone says where it is.
  Friction friction(plain(), kStepS);
  constexpr double kNormalN = 2.0, kBiasMm = 0.03, kShakeMm = 0.02;
  double position_mm = 0.0;
  const auto go_to = [&](double to_mm) {
    friction.advance({to_mm - position_mm, 0.0, 0.0}, 0.0, kNormalN);
    position_mm = to_mm;
  };
  go_to(kBiasMm);
  const double before = bend(friction).x;
  for (int cycle = 0; cycle < 1000; ++cycle) {
    for (int i = 1; i <= 20; ++i) go_to(kBiasMm + kShakeMm * std::sin(2.0 * std::numbers::pi * i / 20));
  }
  EXPECT_NEAR(bend(friction).x, before, 1e-9) << "same place, same force: no drift";
}

TEST(Friction, OpposesMotionInThePlane) {
  for (const double angle : {0.3, 1.7, 3.9, 5.5}) {
    Friction friction(plain(), kStepS);
    const Vector3 direction{std::cos(angle), std::sin(angle), 0.0};
    Vector3 force_n;
    for (int i = 0; i < 2000; ++i) force_n = friction.advance(direction * 2e-3, 0.0, 2.0);
    EXPECT_NEAR(dot(force_n, direction), -length(force_n), 1e-12);
    // A turn by a right angle: the old bend fades, and in the end the force opposes the new motion.
    const Vector3 across{-direction.y, direction.x, 0.0};
    for (int i = 0; i < 3000; ++i) {
      force_n = friction.advance(across * 2e-3, 0.0, 2.0);
      ASSERT_LE(length(force_n), 2.0 * 0.5 * 1.4 + 1e-9) << "never above the static level";
    }
    EXPECT_NEAR(dot(force_n, across), -length(force_n), 1e-9);
  }
}

TEST(Friction, ReversalTurnsTheForceRound) {
  Friction friction(plain(), kStepS);
  for (int i = 0; i < 1000; ++i) friction.advance({5e-3, 0.0, 0.0}, 0.0, 1.0);
  double last = bend(friction).x;
  EXPECT_NEAR(last, -0.5, 1e-9);
  for (int i = 0; i < 500; ++i) {
    friction.advance({-5e-3, 0.0, 0.0}, 0.0, 1.0);
    ASSERT_GE(bend(friction).x, last - 1e-12);
    last = bend(friction).x;
    // The bristles unbend no faster than LuGre's twice the elastic rate allows.
    ASSERT_LE(last, -0.5 + 2.0 * 0.5 / 0.1 * 5e-3 * (i + 1));
  }
  EXPECT_NEAR(last, 0.5, 1e-9);
}

// Beyond breakaway the update is the solution of the LuGre equation at constant velocity: from one bend to
// another in one step or in a hundred.
TEST(Friction, OneLongSlideIsAHundredShortOnes) {
  const auto sliding = [](double velocity_mm_per_s, double step_s) {
    Friction friction(plain(), step_s);
    const double slide_mm = velocity_mm_per_s * step_s;
    for (double path_mm = 0.0; path_mm < 5.0; path_mm += slide_mm)
      friction.advance({slide_mm, 0.0, 0.0}, 0.0, 1.0);
    return friction;
  };
  constexpr double kSlow = 2.0, kSlowStepS = 1e-2;
  // Then the speed rises to 20 mm/s: the Stribeck level drops, the bend follows over the presliding length.
  for (const int pieces : {1, 10, 100}) {
    Friction friction = sliding(kSlow, kSlowStepS / pieces);
    const double slide_mm = 20.0 * kSlowStepS / pieces;
    EXPECT_NEAR(bend(friction).x, -0.5 * (1.0 + 0.4 * std::exp(-0.16)), 1e-9);
    for (int i = 0; i < pieces; ++i) friction.advance({slide_mm, 0.0, 0.0}, 0.0, 1.0);
    const double level = 0.5 * (1.0 + 0.4 * std::exp(-16.0));
    const double from = 0.5 * (1.0 + 0.4 * std::exp(-0.16));
    const double expected = level + (from - level) * std::exp(-0.5 / 0.1 * 0.2 / level);
    EXPECT_NEAR(bend(friction).x, -expected, 1e-9) << pieces << " pieces";
  }
}

TEST(Friction, HoldsATipAsItsSpringWould) {
  // A compliant tip: it moves by free slide minus compliance × force, and the force is that of the motion
  // left over. For bristles bent linearly: F = N (σ s / 2 + σ s · damping/step), s = free - compliance F.
  const FrictionParameters p = plain();
  Friction friction(p, kStepS);
  constexpr double kNormalN = 4.0, kCompliance = 1e-4, kFreeMm = 2e-3;
  const double stiffness = p.kinetic / p.presliding_mm * (0.5 + p.bristle_damping_s / kStepS);
  const double expected_n = kNormalN * stiffness * kFreeMm / (1.0 + kNormalN * stiffness * kCompliance);
  EXPECT_NEAR(-friction.advance({kFreeMm, 0.0, 0.0}, kCompliance, kNormalN).x, expected_n, 1e-3 * expected_n);
}

FrictionParameters rippled() {
  FrictionParameters p = plain();
  p.static_ratio = 1.0;
  p.ripple_share = 0.1;
  p.ripple_wavelength_mm = 4.0;
  return p;
}

TEST(FrictionRipple, TheLevelFollowsTheWaySlipped) {
  FrictionParameters p = rippled();
  p.presliding_mm = 1e-3;  // so that the bristles follow the level at once
  Friction friction(p, kStepS);
  constexpr double kSlideMm = 0.005;
  const auto slide = [&](double direction) {
    return -direction * friction.advance({direction * kSlideMm, 0.0, 0.0}, 0.0, 1.0).x;
  };
  double least = 1.0, most = 0.0;
  for (int i = 0; i < 1600; ++i) {  // two wavelengths there, then back: the way only grows
    const double path_mm = kSlideMm * (i + 0.5);
    const double force = slide(i < 800 ? 1.0 : -1.0);
    if (i % 800 < 10) continue;  // breaking away and turning round take some presliding lengths
    const double expected = 0.5 * (1.0 + 0.1 * std::sin(2.0 * std::numbers::pi * path_mm / 4.0));
    ASSERT_NEAR(force, expected, 1e-3) << "after " << path_mm << " mm";
    least = std::min(least, force);
    most = std::max(most, force);
  }
  EXPECT_NEAR(least, 0.45, 1e-3);
  EXPECT_NEAR(most, 0.55, 1e-3);
}

TEST(FrictionRipple, ContactBeginsTheWayAgain) {
  Friction used(rippled(), kStepS), fresh(rippled(), kStepS);
  for (int i = 0; i < 300; ++i) used.advance({0.01, 0.003, 0.0}, 0.0, 2.0);
  used.release();
  for (int i = 0; i < 300; ++i) {
    ASSERT_EQ(used.advance({0.01, 0.0, 0.0}, 0.0, 2.0).x, fresh.advance({0.01, 0.0, 0.0}, 0.0, 2.0).x);
  }
}

TEST(FrictionRipple, VibrationStaysWhereItIsOnTheRipple) {
  // Bending does not count as way: a million bends later the tip breaks away as the fresh one does.
  Friction shaken(rippled(), kStepS), fresh(rippled(), kStepS);
  for (int i = 0; i < 1'000'000; ++i)
    shaken.advance({(i % 4 == 0 || i % 4 == 3) ? 0.03 : -0.03, 0.0, 0.0}, 0.0, 2.0);
  for (int i = 0; i < 300; ++i) {
    ASSERT_NEAR(shaken.advance({0.01, 0.0, 0.0}, 0.0, 2.0).x, fresh.advance({0.01, 0.0, 0.0}, 0.0, 2.0).x,
                1e-9);
  }
}

TEST(FrictionRipple, IsOfSecondOrderInTheStep) {
  // Work of a slide over a wavelength and a quarter, its pieces ten times and twice as long as the finest.
  const auto bend_after_5_mm = [](int pieces) {
    Friction friction(rippled(), kStepS);
    for (int i = 0; i < pieces; ++i) friction.advance({5.0 / pieces, 0.0, 0.0}, 0.0, 1.0);
    return bend(friction).x;
  };
  const double exact = bend_after_5_mm(20'000);
  const double coarse = std::abs(bend_after_5_mm(50) - exact);
  const double fine = std::abs(bend_after_5_mm(100) - exact);
  EXPECT_LT(coarse, 3e-3 * 0.5) << "0.1 mm a step: 1000 mm/s";
  EXPECT_LT(fine, 0.3 * coarse);
}

TEST(FrictionRipple, HugeSlipsStayBoundedWithItAndWithout) {
  for (const auto& [parameters, highest] : {std::pair{plain(), 0.5 * 1.4}, {rippled(), 0.5 * 1.1}}) {
    for (const double slide_mm : {1.0, 100.0, 1e6, 1e12}) {
      Friction friction(parameters, kStepS);
      for (int i = 0; i < 200; ++i) {
        const double direction = i % 3 == 0 ? -1.0 : 1.0;
        ASSERT_TRUE(finite(friction.advance({direction * slide_mm, 0.3 * slide_mm, 0.0}, 0.0, 4.0)));
        ASSERT_LE(length(bend(friction)), highest + 1e-9);
      }
    }
  }
}

/// Runs a test on the friction of every object under both tips.
void expect_of_every_friction(void (*test)(const FrictionParameters&)) {
  for (const std::string& object : object_preset_names()) {
    for (const Tip tip : {Tip::kRod, Tip::kBallBearing}) {
      SCOPED_TRACE(object + (tip == Tip::kRod ? ", rod" : ", ball bearing"));
      test(object_preset(object)->friction_with(tip));
    }
  }
}

TEST(FrictionPreset, RandomWalksDissipate) {
  expect_of_every_friction([](const FrictionParameters& parameters) {
    Random random(31);
    for (const double scale_mm : {1e-4, 3e-3, 0.03, 1.0}) {
      Friction friction(parameters, kStepS);
      double dissipated_n_mm = 0.0;
      Vector3 velocity;
      for (int i = 0; i < 20'000; ++i) {
        velocity = velocity * 0.95 + Vector3{random.normal(), random.normal(), 0.0} * (0.3 * scale_mm);
        dissipated_n_mm -= dot(friction.advance(velocity, 0.0, 2.0), velocity);
        ASSERT_GE(dissipated_n_mm, -1e-12) << scale_mm << " mm, step " << i;
      }
    }
  });
}

TEST(FrictionPreset, BristlesStayInTheTangentPlaneAndStraightenOnRelease) {
  expect_of_every_friction([](const FrictionParameters& parameters) {
    Friction friction(parameters, kStepS);
    for (int i = 0; i < 100; ++i) friction.advance({0.05, 0.02, 0.01}, 0.0, 2.0);
    const Vector3 normal{0.6, 0.0, 0.8};
    friction.project(normal);
    EXPECT_NEAR(dot(bend(friction), normal), 0.0, 1e-12);
    friction.release();
    EXPECT_EQ(length(bend(friction)), 0.0);
  });
}

}  // namespace
}  // namespace hapticd::sim
