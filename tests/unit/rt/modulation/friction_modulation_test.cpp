#include "rt/modulation/friction_modulation.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <utility>

#include "rt/signal/vector.h"

namespace hapticd::rt {
namespace {

using hal::Vector3;

constexpr double kKinetic = 0.6;
constexpr TickInterval kTick{1e-3, 1.0, 1.0, false};

/// Slides along x at `speed_mm_per_s` under 2 N.
FrictionModulation::Input sliding(double speed_mm_per_s, double normal_n = 2.0) {
  FrictionModulation::Input input;
  input.normal = {0.0, 0.0, 1.0};
  input.friction_n = {-std::copysign(kKinetic * normal_n, speed_mm_per_s), 0.0, 0.0};
  input.normal_n = input.hand_normal_n = normal_n;
  input.step_mm = {1e-3 * speed_mm_per_s, 0.0, 0.0};
  input.velocity_mm_per_s = {speed_mm_per_s, 0.0, 0.0};
  input.interval = kTick;
  return input;
}

Vector3 after(FrictionModulation& modulation, const FrictionModulation::Input& input, int ticks) {
  Vector3 force;
  for (int i = 0; i < ticks; ++i) force = modulation.update(input);
  return force;
}

FrictionModulation scaled(double scale) {
  return {FrictionTarget{scale, std::nullopt}, kKinetic};
}

TEST(FrictionModulation, GivesTheScaleWhileSliding) {
  for (const double scale : {0.5, 1.0, 2.0}) {
    FrictionModulation modulation = scaled(scale);
    EXPECT_NEAR(after(modulation, sliding(50.0), 400).x, -(scale - 1.0) * kKinetic * 2.0, 1e-9) << scale;
    EXPECT_NEAR(after(modulation, sliding(-50.0), 400).x, (scale - 1.0) * kKinetic * 2.0, 1e-9) << scale;
  }
}

TEST(FrictionModulation, GivesTheCoefficientAtTheHand) {
  FrictionModulation modulation({std::nullopt, 0.9}, kKinetic);
  FrictionModulation::Input input = sliding(50.0);
  input.hand_normal_n = 3.0;  // the device renders the object stiffer
  const Vector3 force = after(modulation, input, 400);
  EXPECT_NEAR(-(input.friction_n.x + force.x), 0.9 * 3.0, 1e-9);
}

TEST(FrictionModulation, TakesNothingAwayFromATipAtRest) {
  FrictionModulation less = scaled(0.5);
  EXPECT_LT(norm(after(less, sliding(3.0), 1000)), 1e-12) << "slower than the fade";
  FrictionModulation more = scaled(2.0);
  EXPECT_NEAR(after(more, sliding(3.0), 1000).x, -kKinetic * 2.0, 1e-9);
}

TEST(FrictionModulation, AReversalFadesAReductionOutAndInAgain) {
  FrictionModulation modulation = scaled(0.5);
  after(modulation, sliding(50.0), 400);
  double largest_step_n = 0.0;
  Vector3 before = modulation.force_n();
  double friction_n = -kKinetic * 2.0;
  bool was_gone = false;
  for (int i = 0; i < 400; ++i) {
    FrictionModulation::Input input = sliding(-50.0);
    friction_n += (kKinetic * 2.0 - friction_n) * 0.05;  // builds up over the object's presliding
    input.friction_n.x = friction_n;
    const Vector3 force = modulation.update(input);
    largest_step_n = std::max(largest_step_n, norm(force - before));
    if (modulation.scale() == 1.0) was_gone = true;
    before = force;
  }
  EXPECT_TRUE(was_gone);
  EXPECT_NEAR(modulation.scale(), 0.5, 1e-12);
  EXPECT_LT(largest_step_n, 0.07) << "no jump";
}

TEST(FrictionModulation, AReductionThatIsGoneComesBackSlowly) {
  FrictionModulation modulation = scaled(0.5);
  after(modulation, sliding(50.0), 400);
  after(modulation, sliding(2.0), 100);  // slow, then back
  ASSERT_EQ(modulation.scale(), 1.0);
  FrictionModulation::Input back = sliding(-50.0);
  back.friction_n.x *= -1.0;
  after(modulation, back, 18);
  EXPECT_EQ(modulation.scale(), 1.0) << "presliding is the object's";
  after(modulation, back, 5);
  EXPECT_LT(modulation.scale(), 1.0);
  after(modulation, back, 70);
  EXPECT_NEAR(modulation.scale(), 0.75, 0.03) << "half of it after half of the rise";
  after(modulation, back, 80);
  EXPECT_NEAR(modulation.scale(), 0.5, 1e-12);
}

TEST(FrictionModulation, IsBoundedInDirectionAndSize) {
  FrictionModulation modulation = scaled(2.0);
  FrictionModulation::Input input = sliding(50.0);
  input.friction_n = {-1.0, 5.0, 0.0};  // mostly across the sliding: an error of the direction
  Vector3 force = after(modulation, input, 400);
  EXPECT_NEAR(force.x, -1.0, 1e-9);
  EXPECT_NEAR(force.y, 0.0, 1e-9);
  input.friction_n = {-50.0, 0.0, 0.0};
  force = after(modulation, input, 400);
  EXPECT_NEAR(force.x, -FrictionModulation::kMaxLevel * kKinetic * 2.0, 1e-9);
  EXPECT_NEAR(dot(force, input.normal), 0.0, 1e-12);
  FrictionModulation most({std::nullopt, 3.0}, 0.1);
  input = sliding(50.0);
  input.friction_n.x = -0.2;
  EXPECT_NEAR(after(most, input, 400).x, -0.4, 1e-9) << "three times at most";
  EXPECT_TRUE(most.is_bounded());
}

TEST(FrictionModulation, NeitherLoadNorTimeNorNumberMattersWhereThereIsNone) {
  for (const double scale : {0.5, 2.0}) {
    FrictionModulation modulation = scaled(scale);
    after(modulation, sliding(50.0), 400);
    FrictionModulation::Input input = sliding(50.0);
    input.normal_n = input.hand_normal_n = 0.0;
    EXPECT_EQ(norm(modulation.update(input)), 0.0) << "no load, no force";
    for (double* number : {&input.friction_n.x, &input.normal.y, &input.step_mm.z, &input.velocity_mm_per_s.x,
                           &input.normal_n, &input.hand_normal_n}) {
      for (const double bad :
           {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity()}) {
        const double good = std::exchange(*number, bad);
        EXPECT_EQ(norm(modulation.update(input)), 0.0);
        *number = good;
      }
    }
    EXPECT_NEAR(after(modulation, sliding(50.0), 400).x, -(scale - 1.0) * kKinetic * 2.0, 1e-9) << "recovers";
  }
}

TEST(FrictionModulation, TheMeasuredTimeRulesTheFade) {
  FrictionModulation modulation = scaled(0.5);
  FrictionModulation::Input late = sliding(50.0);
  late.interval = {5e-3, 5.0, 5.0, false};
  late.step_mm = late.step_mm * 5.0;
  after(modulation, late, 80);
  EXPECT_NEAR(modulation.scale(), 0.5, 1e-12);
  FrictionModulation in_time = scaled(0.5);
  after(in_time, sliding(50.0), 110);
  FrictionModulation by_fives = scaled(0.5);
  after(by_fives, late, 22);
  EXPECT_NEAR(by_fives.scale(), in_time.scale(), 0.03);
}

TEST(FrictionModulation, TheRangeIsThatOfDeviceAndBounds) {
  const FrictionRange range = feasible_friction(1.2, 2.0, 0.5);
  EXPECT_NEAR(range.min, 0.6 * 0.15, 1e-12);
  EXPECT_NEAR(range.max, 0.6 + 0.25, 1e-12);
  EXPECT_NEAR(feasible_friction(1.2, 2.0, 50.0).max, 0.6 + FrictionModulation::kMaxAddedN / 2.0, 1e-12);
  EXPECT_NEAR(feasible_friction(0.2, 1.0, 50.0).max, 0.6, 1e-12);
  EXPECT_EQ(feasible_friction(1.2, 0.0, 0.5).max, 0.0);
}

TEST(FrictionTarget, IsOneOfTwoAndInRange) {
  EXPECT_FALSE(check(FrictionTarget{1.5, std::nullopt}, "friction_target.", "scene"));
  EXPECT_TRUE(check(FrictionTarget{}, "friction_target.", "scene"));
  EXPECT_TRUE(check(FrictionTarget{1.0, 0.5}, "friction_target.", "scene"));
  for (const double bad : {0.1, 3.1, std::numeric_limits<double>::quiet_NaN()}) {
    const auto error = check(FrictionTarget{bad, std::nullopt}, "friction_target.", "scene");
    ASSERT_TRUE(error);
    EXPECT_NE(error->what.find("friction_target.scale"), std::string::npos);
  }
}

}  // namespace
}  // namespace hapticd::rt
