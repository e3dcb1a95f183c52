// Maxwell-slip friction: levels, presliding loops, energy, extremes.

#include "hal/sim/object/general_friction.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "hal/sim/base/random.h"
#include "hal/sim/object/object_model.h"
#include "tests/unit/sim/virtual_rig.h"

namespace hapticd::sim {
namespace {

using hal::Vector3;
using test::length;

constexpr double kGeneralStepS = 1e-4;

FrictionParameters plain_general() {
  return {.kinetic = 0.5, .static_ratio = 1.4, .presliding_mm = 0.1, .bristle_damping_s = 0.0};
}

MaxwellSlipFriction plain_friction(double step_s = kGeneralStepS) {
  return {plain_general(), {}, step_s};
}

/// Mean force of sliding a way at a speed, after as much way to break away.
double sliding_n(MaxwellSlipFriction friction, double normal_n, double speed_mm_per_s,
                 double step_s = kGeneralStepS) {
  const int steps = static_cast<int>(std::ceil(2.0 / (speed_mm_per_s * step_s)));
  double force_n = 0.0;
  for (int i = 0; i < steps; ++i)
    force_n = -friction.advance({speed_mm_per_s * step_s, 0.0, 0.0}, 0.0, normal_n).x;
  return force_n;
}

TEST(MaxwellSlip, SlidesAtTheSeparableLevelAtTheReference) {
  const GeneralFrictionParameters shape;
  EXPECT_NEAR(sliding_n(plain_friction(), shape.reference_load_n, shape.reference_speed_mm_per_s),
              0.5 * shape.reference_load_n, 0.01 * 0.5 * shape.reference_load_n);
}

TEST(MaxwellSlip, TheLevelGrowsWithThePowerOfTheLoad) {
  const double one_n = sliding_n(plain_friction(), 1.0, 50.0);
  for (const double load_n : {0.01, 0.1, 0.5, 2.0, 8.0, 30.0}) {
    EXPECT_NEAR(std::log(sliding_n(plain_friction(), load_n, 50.0) / one_n) / std::log(load_n), 0.88, 1e-6)
        << load_n;
  }
}

TEST(MaxwellSlip, SpeedWeakensThenStrengthens) {
  std::vector<double> levels;
  for (const double speed : {0.5, 5.0, 20.0, 60.0, 1000.0})
    levels.push_back(sliding_n(plain_friction(), 2.0, speed));
  EXPECT_GT(levels[0], 1.2 * levels[2]) << "static excess";
  EXPECT_GT(levels[1], levels[2]);
  EXPECT_GT(levels[4], 1.03 * levels[3]) << "grows with the logarithm of the speed";
}

/// Friction over displacement of a loop of some amplitude, from the second cycle on; returns its area.
double loop_area_n_mm(double normal_n, double amplitude_mm, double& largest_n) {
  MaxwellSlipFriction friction = plain_friction();
  double area = 0.0, position_mm = 0.0;
  constexpr int kQuarter = 5000;
  for (int i = 0; i < 12 * kQuarter; ++i) {
    const double next_mm = amplitude_mm * std::sin(0.5 * 3.14159265358979 * (i + 1) / kQuarter);
    const double force_n = -friction.advance({next_mm - position_mm, 0.0, 0.0}, 0.0, normal_n).x;
    if (i >= 8 * kQuarter) {
      area += force_n * (next_mm - position_mm);
      largest_n = std::max(largest_n, std::abs(force_n));
    }
    position_mm = next_mm;
  }
  return area;
}

TEST(MaxwellSlip, PreslidingLoopsCloseAndHaveAnArea) {
  // Below the first element's slip nothing is lost; above it the more the longer the way.
  double force_n = 0.0;
  EXPECT_NEAR(loop_area_n_mm(2.0, 0.05, force_n), 0.0, 1e-9);
  double last = 0.0;
  for (const double amplitude_mm : {0.14, 0.17, 0.25, 0.4}) {
    double largest_n = 0.0;
    const double area = loop_area_n_mm(2.0, amplitude_mm, largest_n);
    EXPECT_GT(area, last + 1e-4) << amplitude_mm;
    EXPECT_LT(area, 4.0 * amplitude_mm * largest_n) << "inside its rectangle";
    last = area;
  }
}

TEST(MaxwellSlip, PreslidingLengthGrowsWithTheLoad) {
  const auto path_to_half_mm = [](double load_n) {
    MaxwellSlipFriction friction = plain_friction();
    const double half_n = 0.5 * friction.level_n(load_n, 0.0);
    double path_mm = 0.0;
    while (-friction.advance({1e-5, 0.0, 0.0}, 0.0, load_n).x < half_n) path_mm += 1e-5;
    return path_mm;
  };
  const double at_1n_mm = path_to_half_mm(1.0);
  const double at_8n_mm = path_to_half_mm(8.0);
  EXPECT_NEAR(std::log(at_8n_mm / at_1n_mm) / std::log(8.0), 0.88 - 1.0 / 3.0, 0.01);
  EXPECT_NEAR(plain_friction().presliding_mm(2.0), 0.1, 1e-12);
}

TEST(MaxwellSlip, IsNoDahl) {
  // From a reversal on, a Dahl's force would have done 1 - exp(-0.85 · 2) … of its way where this one is
  // still straight.
  MaxwellSlipFriction friction = plain_friction();
  const double slow_mm = 1e-4;
  for (int i = 0; i < 20'000; ++i) friction.advance({-slow_mm, 0.0, 0.0}, 0.0, 2.0);
  const double from_n = -friction.advance({}, 0.0, 2.0).x;
  const auto after = [&](double path_mm) {
    MaxwellSlipFriction copy = friction;
    double force_n = 0.0;
    for (double way = 0.0; way < path_mm; way += slow_mm)
      force_n = -copy.advance({slow_mm, 0.0, 0.0}, 0.0, 2.0).x;
    return force_n - from_n;
  };
  const double level_n = friction.level_n(2.0, slow_mm / kGeneralStepS);
  const double straight_mm = 1.6 * level_n / (0.5 * 2.0 / 0.1);
  EXPECT_NEAR(after(0.5 * straight_mm) / after(0.25 * straight_mm), 2.0, 0.02) << "straight";
  EXPECT_NEAR(after(3.2 * level_n / 10.0), 2.0 * level_n, 1e-6) << "and done at a finite way";
}

TEST(MaxwellSlip, NoWalkAndNoLoadGainsWork) {
  Random random(31);
  for (const bool bearing : {false, true}) {
    for (const std::string& name : object_preset_names()) {
      const ObjectModel object = *object_preset(name);
      for (const double scale_mm : {1e-4, 3e-3, 0.03, 1.0}) {
        MaxwellSlipFriction friction(object.friction_with(bearing ? Tip::kBallBearing : Tip::kRod),
                                     object.general_friction, kGeneralStepS);
        double work_n_mm = 0.0, load_n = 2.0;
        Vector3 velocity;
        for (int i = 0; i < 5000; ++i) {
          velocity = velocity * 0.95 + Vector3{random.normal(), random.normal(), 0.0} * (0.3 * scale_mm);
          load_n = std::clamp(load_n * std::exp(0.3 * random.normal()), 0.01, 30.0);
          work_n_mm -= dot(friction.advance(velocity, 0.0, load_n), velocity);
          ASSERT_GE(work_n_mm, friction.stored_n_mm() - 1e-9) << name << " " << scale_mm << " mm, step " << i;
        }
      }
    }
  }
}

TEST(MaxwellSlip, StretchesAsFarAsItsSpringLets) {
  // While nothing slips: F = (k/2 + k damping/step) s with s = free - compliance F; from soft tips to stiff
  // contacts.
  FrictionParameters p = plain_general();
  p.bristle_damping_s = 5e-5;
  for (const double compliance : {0.0, 1e-4, 1e-2, 10.0}) {
    MaxwellSlipFriction friction(p, {}, kGeneralStepS);
    constexpr double kFreeMm = 2e-3;
    const double k = 0.5 * 2.0 / 0.1 * (0.5 + 0.5);
    const double expected_n = k * kFreeMm / (1.0 + k * compliance);
    EXPECT_NEAR(-friction.advance({kFreeMm, 0.0, 0.0}, compliance, 2.0).x, expected_n,
                1e-9 + 1e-6 * expected_n)
        << compliance;
  }
}

TEST(MaxwellSlip, ASmallerStepFindsTheSame) {
  // Against the finest: the kinks of slipping are of first order, the straight pieces exact.
  const auto work_n_mm = [](int pieces) {
    MaxwellSlipFriction friction(plain_general(), {}, 0.1 / pieces);
    double work = 0.0, before_mm = 0.0;
    for (int i = 0; i < pieces; ++i) {
      const double to_mm = 0.25 * std::sin(6.0 * (i + 1.0) / pieces);
      const Vector3 slide{to_mm - before_mm, 0.3 * (to_mm - before_mm), 0.0};
      work -= dot(friction.advance(slide, 0.0, 3.0), slide);
      before_mm = to_mm;
    }
    return work;
  };
  const double exact = work_n_mm(64'000);
  const double coarse = std::abs(work_n_mm(125) - exact);
  const double fine = std::abs(work_n_mm(1000) - exact);
  EXPECT_LT(fine, 0.3 * coarse);
  EXPECT_LT(fine, 3e-3 * exact);
}

TEST(MaxwellSlip, ForgetsWhenLetGo) {
  MaxwellSlipFriction used(object_preset("rubber_ball")->friction, {}, kGeneralStepS);
  MaxwellSlipFriction fresh = used;
  for (int i = 0; i < 300; ++i) used.advance({0.01, 0.003, 0.0}, 0.0, 2.0);
  EXPECT_EQ(length(used.advance({0.01, 0.0, 0.0}, 0.0, 0.0)), 0.0) << "no load, no friction";
  used.release();
  EXPECT_EQ(used.stored_n_mm(), 0.0);
  for (int i = 0; i < 100; ++i) {
    ASSERT_EQ(used.advance({0.01, 0.0, 0.0}, 0.0, 2.0).x, fresh.advance({0.01, 0.0, 0.0}, 0.0, 2.0).x);
  }
}

TEST(MaxwellSlip, StaysInTheTangentPlane) {
  MaxwellSlipFriction friction = plain_friction();
  for (int i = 0; i < 100; ++i) friction.advance({0.05, 0.02, 0.01}, 0.0, 2.0);
  const Vector3 normal{0.6, 0.0, 0.8};
  friction.project(normal);
  EXPECT_NEAR(dot(friction.advance({}, 0.0, 2.0), normal), 0.0, 1e-12);
}

TEST(MaxwellSlip, ExtremesStayFiniteAndBounded) {
  for (const double slide_mm : {1e-300, 1.0, 100.0, 1e6, 1e12}) {
    for (const double load_n : {1e-300, 1e-9, 4.0, 1e6}) {
      for (const double compliance : {0.0, 1e-4, 1e3}) {
        MaxwellSlipFriction friction(object_preset("rubber_ball")->friction, {}, kGeneralStepS);
        for (int i = 0; i < 50; ++i) {
          const double direction = i % 3 == 0 ? -1.0 : 1.0;
          const Vector3 force_n =
              friction.advance({direction * slide_mm, 0.3 * slide_mm, 0.0}, compliance, load_n);
          ASSERT_TRUE(finite(force_n));
        }
      }
    }
  }
}

}  // namespace
}  // namespace hapticd::sim
