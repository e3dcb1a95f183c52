#include "rt/target/target_blend.h"

#include "tests/unit/rt/deformation/directions.h"

namespace hapticd::rt {
namespace {

using namespace test;

TargetLaw random_law(std::mt19937_64& random) {
  std::uniform_int_distribution<int> kind(0, 3);
  std::uniform_real_distribution<double> stiffness(0.0, 2.0), exponent(1.0, 3.0);
  TargetLaw law;
  law.kind = static_cast<TargetLaw::Kind>(kind(random));
  law.stiffness_n_per_mm = stiffness(random);
  law.hunt_crossley = {0.3 * stiffness(random), 0.0, exponent(random)};
  law.knots = {TargetLaw::Knot{0.0, stiffness(random)}, {2.0, stiffness(random)}, {5.0, stiffness(random)}};
  law.knot_count = 3;
  return law;
}

TEST(TargetBlend, ARampIsStraightAndEndsExactlyOnTheNewLaw) {
  TargetBlend blend(linear_target(0.3), 1000.0);
  EXPECT_DOUBLE_EQ(blend.update(5.0, 0.0, {}), 1.5);
  blend.set(linear_target(0.7), 0.1);
  for (int i = 1; i <= 100; ++i) {
    EXPECT_NEAR(blend.update(5.0, 0.0, {}), 1.5 + 2.0 * i / 100.0, 1e-12);
    EXPECT_NEAR(blend.stiffness_n_per_mm(), 0.3 + 0.4 * i / 100.0, 1e-12);
  }
  EXPECT_DOUBLE_EQ(blend.update(5.0, 0.0, {}), 3.5);
  EXPECT_DOUBLE_EQ(blend.stiffness_n_per_mm(), 0.7);
}

TEST(TargetBlend, MovesTheForceNoFasterThanItIsAllowedTo) {
  TargetBlend blend(linear_target(0.3), 1000.0, 4.0);
  double before_n = blend.update(5.0, 0.0, {});
  blend.set(linear_target(0.7), 0.1);
  for (int i = 1; i <= 500; ++i) {
    const double force_n = blend.update(5.0, 0.0, {});
    EXPECT_NEAR(force_n - before_n, 0.004, 1e-12) << i;
    before_n = force_n;
  }
  EXPECT_DOUBLE_EQ(blend.update(5.0, 0.0, {}), 3.5);
  blend.set(linear_target(0.3), 0.1);
  for (int i = 0; i < 100; ++i) blend.rest();
  EXPECT_DOUBLE_EQ(blend.update(5.0, 0.0, {}), 1.5) << "out of contact there is no force to change";
}

/// Held at one displacement, whatever is set when: no tick moves the force by more than its share of the
/// way from where it was at the change to where the change leads.
TEST(TargetBlend, NoSequenceOfSwitchesInContactMakesAJump) {
  std::mt19937_64 random(42);
  std::uniform_real_distribution<double> ramp(0.0, 0.2), depth(0.1, 6.0);
  std::uniform_int_distribution<int> dice(0, 39);
  for (int round = 0; round < 100; ++round) {
    TargetBlend blend(random_law(random), 1000.0);
    const double x = depth(random);
    double force = blend.update(x, 0.0, {});
    double share = 1.0, from = force, to = force;
    for (int i = 0; i < 2000; ++i) {
      for (int sets = dice(random) == 0 ? 1 + dice(random) % 3 : 0; sets > 0; --sets) {
        const TargetLaw law = random_law(random);
        const double ramp_s = ramp(random);
        blend.set(law, ramp_s);
        share = 1.0 / std::max(1.0, 1000.0 * ramp_s);
        from = force;
        to = law.force_n(x, 0.0, {});
      }
      const double next = blend.update(x, 0.0, {});
      ASSERT_LE(std::abs(next - force), share * std::abs(to - from) + 1e-9) << round << ", tick " << i;
      ASSERT_GE(next, -1e-12);
      force = next;
    }
    for (int i = 0; i < 201; ++i) force = blend.update(x, 0.0, {});
    EXPECT_DOUBLE_EQ(force, to) << "exactly the last one in the end";
  }
}

TEST(TargetBlend, WhileTheTipMovesTheJumpIsTheLawsOwn) {
  // Each tick's change is bounded by the share of the ramp and by how fast the laws rise.
  std::mt19937_64 random(43);
  std::uniform_int_distribution<int> dice(0, 29);
  std::uniform_real_distribution<double> stiffness(0.0, 2.0);
  TargetBlend blend(linear_target(0.5), 1000.0);
  double before = blend.update(3.0, 0.0, {});
  for (int i = 1; i < 20'000; ++i) {
    const double x = 3.0 + 2.0 * std::sin(0.01 * i);  // 0.02 mm a tick
    if (dice(random) == 0) blend.set(linear_target(stiffness(random)), 0.1);
    const double force = blend.update(x, 0.0, {});
    // 10 N at most apart, over 100 ticks; three laws' 2 N/mm over 0.02 mm.
    ASSERT_LE(std::abs(force - before), 0.1 + 3 * 2.0 * 0.02);
    before = force;
  }
}

TEST(TargetBlend, OutOfContactOnlyTimePasses) {
  TargetBlend blend(linear_target(0.3), 1000.0);
  blend.update(5.0, 0.0, {});
  blend.rest();
  blend.set(linear_target(0.7), 0.1);
  for (int i = 0; i < 100; ++i) blend.rest();
  EXPECT_DOUBLE_EQ(blend.update(2.0, 0.0, {}), 1.4)
      << "the ramp is over, nothing of the last contact is left";
  blend.set(linear_target(0.1), 0.1);
  blend.update(2.0, 0.0, {});
  blend.set(linear_target(1.1), 0.1);
  blend.update(2.0, 0.0, {});  // a change that interrupted another: an offset is kept
  blend.rest();                // but not past a release
  for (int i = 0; i < 48; ++i) blend.rest();
  EXPECT_NEAR(blend.update(2.0, 0.0, {}), 0.51 * 2.2 + 0.49 * 0.2, 1e-9);
}

TEST(TargetBlend, AChangeTheTickAContactBeginsStartsFromNothing) {
  TargetBlend blend(linear_target(0.3), 1000.0);
  blend.rest();
  blend.set(linear_target(0.7), 0.1);
  double before = 0.0;
  for (int i = 0; i < 200; ++i) {
    const double force = blend.update(0.01 * i, 0.0, {});
    ASSERT_LE(std::abs(force - before), 0.05);
    before = force;
  }
  EXPECT_NEAR(before, 0.7 * 1.99, 1e-12);
}

TEST(TargetBlend, TheReportedStiffnessIsForceOverDisplacementAlsoWhereAChangeInterruptsAnother) {
  TargetBlend blend(linear_target(0.5), 1000.0);
  blend.update(4.0, 0.0, {});
  blend.set(linear_target(1.0), 0.1);
  for (int i = 0; i < 150; ++i) {
    if (i == 50) blend.set(linear_target(0.2), 0.1);
    const double force = blend.update(4.0, 0.0, {});
    ASSERT_NEAR(blend.stiffness_n_per_mm(), force / 4.0, 1e-9) << i;
  }
}

}  // namespace
}  // namespace hapticd::rt
