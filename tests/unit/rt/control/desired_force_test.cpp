#include "rt/target/desired_force.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "rt/target/device_reach.h"
#include "rt/target/feasible_range.h"
#include "rt/target/target_ramp.h"

namespace hapticd::rt {
namespace {

TEST(DesiredForce, RigidIsEquationThreeThree) {
  const DesiredForce d = desired_force_rigid(1.9, 0.3, 5.0);
  EXPECT_NEAR(d.force_n, 1.9 - 1.5, 1e-12);
  EXPECT_EQ(d.displacement_mm, 5.0);
  EXPECT_EQ(desired_force_rigid(0.4, 0.3, -2.0).force_n, 0.4)
      << "outside the contact point nothing is rendered";
}

TEST(DesiredForce, CompensatedTheHandFeelsTheTarget) {
  // Statics of a bent device: a hand that feels the target under 1 N has its tip at 1/target; the object
  // pushes back with k x, the device makes up the difference, and the encoders see the tip plus the bending.
  // From what sensor and encoders then read, the desired force must be that very difference.
  for (const double structural : {2.537, 3.5}) {
    for (const double object : {0.0, 0.18, 0.38, 2.26, 50.0}) {
      for (const double target : {0.1, 0.3, 0.7, 1.5, 2.0}) {
        const double tip_mm = 1.0 / target;
        const double device_n = object * tip_mm - 1.0;
        const double encoder_mm = tip_mm + device_n / structural;
        const DesiredForce d = desired_force_compensated(object * tip_mm, target, encoder_mm, structural);
        EXPECT_NEAR(d.force_n, device_n, 1e-9 * (1.0 + std::abs(device_n))) << object << " to " << target;
        EXPECT_NEAR(d.displacement_mm, tip_mm, 1e-9 * tip_mm) << object << " to " << target;
      }
    }
  }
}

TEST(DesiredForce, IsContinuousWhereTheTipLeavesTheSurface) {
  const double structural = 3.5;
  double last = desired_force_compensated(0.2, 0.7, -1.0, structural).force_n;
  for (double x = -1.0; x < 1.0; x += 1e-4) {
    const double force = desired_force_compensated(0.2, 0.7, x, structural).force_n;
    ASSERT_LT(std::abs(force - last), 2e-4);
    last = force;
  }
}

TEST(DesiredForce, StaysFiniteAtAndBeyondTheStructuralStiffness) {
  for (const double target : {2.8, 3.5, 3.6, 350.0, 1e6}) {
    const DesiredForce d = desired_force_compensated(1.0, target, 1.0, 3.5);
    EXPECT_TRUE(std::isfinite(d.force_n));
    EXPECT_TRUE(std::isfinite(d.displacement_mm));
  }
}

TEST(FeasibleRange, IsEquationThreeEight) {
  // D Fig. 3.8: k = 1 N/mm on a device of 8.5 N.
  const FeasibleRange weak = feasible_range(1.0, 2.0, 8.5);
  EXPECT_NEAR(weak.min_n_per_mm, 2.0 / 10.5, 1e-12);
  EXPECT_TRUE(std::isinf(weak.max_n_per_mm));
  const FeasibleRange strong = feasible_range(1.0, 17.0, 8.5);
  EXPECT_NEAR(strong.min_n_per_mm, 17.0 / 25.5, 1e-12);
  EXPECT_NEAR(strong.max_n_per_mm, 2.0, 1e-12);
}

TEST(FeasibleRange, AHandThatDoesNotPressLeavesEverythingOpen) {
  for (const double hand : {0.0, -1.0, std::numeric_limits<double>::quiet_NaN()}) {
    const FeasibleRange range = feasible_range(1.0, hand, 8.5);
    EXPECT_EQ(range.min_n_per_mm, 0.0);
    EXPECT_TRUE(std::isinf(range.max_n_per_mm));
  }
}

TEST(FeasibleRange, PullAndPushBoundItsTwoEnds) {
  const FeasibleRange range = feasible_range(2.0, 6.0, {24.0, 4.0});
  EXPECT_NEAR(range.min_n_per_mm, 2.0 * 6.0 / 30.0, 1e-12);
  EXPECT_NEAR(range.max_n_per_mm, 2.0 * 6.0 / 2.0, 1e-12);
}

ObjectModel of_law(double stiffness_n_per_mm_m, double exponent) {
  ObjectModel model;
  model.hunt_crossley = IdentifiedLaw<HuntCrossleyParameters>{{stiffness_n_per_mm_m, 1e-3, exponent}, 0.05};
  return model;
}

TEST(FeasibleRange, OfABentLawEndsWhereTheObjectTakesAllThatTheDeviceGives) {
  // The hand feels k~ = f_h/x where the object pushes back with K x^m = f_h + f_pull, or f_h - f_push.
  for (const double exponent : {1.0, 1.6, 3.0}) {
    for (const double stiffness : {1e-4, 0.05, 20.0}) {
      const auto range = feasible_range(of_law(stiffness, exponent), 12.0, {24.5, 8.5});
      ASSERT_TRUE(range);
      const double deepest_mm = 12.0 / range->min_n_per_mm;
      const double shallowest_mm = 12.0 / range->max_n_per_mm;
      EXPECT_NEAR(stiffness * std::pow(deepest_mm, exponent), 12.0 + 24.5, 1e-6);
      EXPECT_NEAR(stiffness * std::pow(shallowest_mm, exponent), 12.0 - 8.5, 1e-6);
    }
  }
  const ObjectModel dense = of_law(0.05, 3.0);
  EXPECT_GT(feasible_range(dense, 4.0, {24.5, 8.5})->min_n_per_mm,
            feasible_range(*stiffness_n_per_mm(dense, 4.0), 4.0, {24.5, 8.5}).min_n_per_mm)
      << "softer to feel is deeper, and deeper it is stiffer";
  EXPECT_TRUE(std::isinf(feasible_range(dense, 4.0, {24.5, 8.5})->max_n_per_mm));
}

TEST(FeasibleRange, TakesTheCreepLawBeforeTheOther) {
  ObjectModel model = of_law(0.05, 1.0);
  CreepParameters creep{.max_force_n = 40.0};
  for (std::size_t j = 0; j < CreepParameters::kKnots; ++j) {
    const double share = static_cast<double>(j) / (CreepParameters::kKnots - 1);
    creep.displacement_mm[j] = 20.0 * share;  // x = 20 mm sqrt(f/40 N) at the knots
  }
  model.creep = IdentifiedLaw<CreepParameters>{creep, 0.05};
  // 5.625 N + 16.875 N = 22.5 N is the knot of 12/16.
  EXPECT_NEAR(feasible_range(model, 5.625, {16.875, 16.875})->min_n_per_mm, 5.625 / 15.0, 1e-9);
}

TEST(FeasibleRange, OfALawThatIsNoneThereIsNone) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_FALSE(feasible_range(ObjectModel{}, 4.0, {24.5, 24.5}));
  EXPECT_FALSE(feasible_range(of_law(nan, 1.5), 4.0, {24.5, 24.5}));
  EXPECT_FALSE(feasible_range(of_law(1.0, nan), 4.0, {24.5, 24.5}));
  EXPECT_FALSE(feasible_range(of_law(1.0, 1.5), 4.0, {nan, 24.5}));
  for (const double hand : {0.0, -1.0, nan}) {
    const auto open = feasible_range(of_law(1.0, 1.5), hand, {24.5, 24.5});
    ASSERT_TRUE(open);
    EXPECT_EQ(open->min_n_per_mm, 0.0);
    EXPECT_TRUE(std::isinf(open->max_n_per_mm));
  }
}

TEST(LargestPull, LeavesTheHandItsShareOfTheSensor) {
  EXPECT_NEAR(pull_within_sensor_n(35.0), 24.5, 1e-12);
  for (const double unknown : {0.0, -1.0, std::numeric_limits<double>::quiet_NaN()}) {
    EXPECT_TRUE(std::isinf(pull_within_sensor_n(unknown)));
  }
  hal::RigInfo rig;
  rig.sensor.range_n = 17.0;
  EXPECT_NEAR(pull_within_sensor_n(rig), 0.7 * 17.0, 1e-12);
  rig.renders_force = false;
  EXPECT_TRUE(std::isinf(pull_within_sensor_n(rig))) << "a recording knows only the largest force in it";
}

TEST(TargetRamp, MovesLinearlyAndArrivesExactly) {
  TargetRamp ramp(0.3, 1000.0);
  ramp.set(0.7, 0.1);
  for (int i = 1; i <= 100; ++i) EXPECT_NEAR(ramp.update(), 0.3 + 0.004 * i, 1e-9);
  EXPECT_EQ(ramp.update(), 0.7);
}

TEST(TargetRamp, ANewGoalStartsFromTheValueInForce) {
  TargetRamp ramp(0.0, 1000.0);
  ramp.set(1.0, 1.0);
  for (int i = 0; i < 500; ++i) ramp.update();
  const double before = ramp.value();
  ramp.set(0.0, 0.1);
  EXPECT_NEAR(ramp.update(), before - before / 100.0, 1e-12);
}

}  // namespace
}  // namespace hapticd::rt
