#include "rt/target/target_law.h"

#include "tests/unit/rt/deformation/directions.h"

namespace hapticd::rt {
namespace {

using namespace test;

TargetLaw profile(TargetLaw::Kind kind, std::initializer_list<TargetLaw::Knot> knots) {
  TargetLaw law;
  law.kind = kind;
  for (const TargetLaw::Knot& knot : knots) law.knots[law.knot_count++] = knot;
  return law;
}
TargetLaw power_law(double k, double b, double m) {
  return {.kind = TargetLaw::Kind::kHuntCrossley, .hunt_crossley = {k, b, m}};
}

TEST(TargetLaw, LinearIsHookes) {
  const TargetLaw law = linear_target(0.7);
  EXPECT_DOUBLE_EQ(law.force_n(3.0, 100.0, {5.0, 6.0, 7.0}), 2.1);
  EXPECT_EQ(law.force_n(0.0, 100.0, {}), 0.0);
  EXPECT_EQ(law.force_n(-2.0, 0.0, {}), 0.0) << "outside there is nothing";
}

TEST(TargetLaw, HuntCrossleyIsItsClosedForm) {
  const TargetLaw law = power_law(0.2, 2e-4, 1.7);
  EXPECT_NEAR(law.force_n(4.0, 30.0, {}), (0.2 + 2e-4 * 30.0) * std::pow(4.0, 1.7), 1e-12);
  EXPECT_EQ(law.force_n(4.0, -2000.0, {}), 0.0) << "it does not pull";
  EXPECT_EQ(law.force_n(-1.0, 0.0, {}), 0.0);
}

TEST(TargetLaw, ItsDampingIsHeldToWhatIsPassiveAtTheLoopsRate) {
  TargetLaw law = power_law(0.2, 0.005, 2.0);
  EXPECT_FALSE(check(law, "test"));
  const double elastic_n = 0.2 * 16.0;
  EXPECT_NEAR(law.force_n(4.0, 100.0, {}) - elastic_n, 100.0 * kMaxTargetDampingNsPerMm, 1e-12);
  EXPECT_NEAR(law.force_n(0.5, 100.0, {}) - 0.05, 100.0 * 0.005 * 0.25, 1e-12) << "less as it is";
  EXPECT_EQ(damping_n_s_per_mm(law, 4.0), kMaxTargetDampingNsPerMm);
  EXPECT_EQ(damping_n_s_per_mm(linear_target(1.0), 4.0), 0.0);
  EXPECT_EQ(max_target_damping_n_s_per_mm(5000.0), kMaxTargetDampingNsPerMm);
  EXPECT_EQ(max_target_damping_n_s_per_mm(500.0), 0.5 * kMaxTargetDampingNsPerMm);
  for (const double damping : {0.0051, 0.1, 10.0, std::nan("")}) {
    law = power_law(0.2, damping, 1.0);
    const auto error = check(law, "test");
    ASSERT_TRUE(error) << damping;
    EXPECT_NE(error->what.find("hunt_crossley.damping_n_s_per_mm_m1"), std::string::npos);
  }
}

TEST(TargetLaw, ADisplacementProfileIsTheIntegralOfItsStiffness) {
  const TargetLaw law =
      profile(TargetLaw::Kind::kDisplacementProfile, {{1.0, 0.2}, {2.0, 1.5}, {2.5, 0.0}, {6.0, 0.4}});
  const auto stiffness = [](double x) {
    if (x <= 1.0) return 0.2;
    if (x <= 2.0) return 0.2 + 1.3 * (x - 1.0);
    if (x <= 2.5) return 1.5 - 3.0 * (x - 2.0);
    if (x <= 6.0) return 0.4 * (x - 2.5) / 3.5;
    return 0.4;
  };
  double integral = 0.0;
  constexpr double kStep = 1e-4;
  for (int i = 0; i < 100'000; ++i) {
    integral += kStep * stiffness((i + 0.5) * kStep);
    if (i % 997 == 0) {
      ASSERT_NEAR(law.force_n((i + 1) * kStep, 0.0, {}), integral, 1e-6) << i;
    }
  }
}

TEST(TargetLaw, RandomProfilesRiseWithTheirStiffnessAndNeverJump) {
  std::mt19937_64 random(40);
  std::uniform_real_distribution<double> gap(1e-6, 3.0), stiffness(0.0, 20.0);
  std::uniform_int_distribution<int> count(1, TargetLaw::kMaxKnots);
  for (int round = 0; round < 200; ++round) {
    TargetLaw law;
    law.kind = TargetLaw::Kind::kDisplacementProfile;
    double at = 0.0;
    for (int i = count(random); i > 0; --i) {
      at += gap(random);
      law.knots[law.knot_count++] = {at, stiffness(random)};
    }
    ASSERT_FALSE(check(law, "here"));
    EXPECT_EQ(law.force_n(0.0, 0.0, {}), 0.0);
    double last = 0.0;
    for (double x = 0.01; x < at + 5.0; x += 0.01) {
      const double force = law.force_n(x, 0.0, {});
      ASSERT_GE(force, last);
      ASSERT_LE(force - last, 0.01 * 20.0 + 1e-9);
      last = force;
    }
  }
}

TEST(TargetLaw, AOneKnotProfileIsALinearLaw) {
  const TargetLaw law = profile(TargetLaw::Kind::kDisplacementProfile, {{3.0, 0.8}});
  for (const double x : {0.5, 3.0, 10.0}) EXPECT_NEAR(law.force_n(x, 0.0, {}), 0.8 * x, 1e-12);
}

TEST(TargetLaw, APositionProfileTakesItsStiffnessFromWhereTheTipIs) {
  TargetLaw law = profile(TargetLaw::Kind::kPositionProfile, {{-10.0, 0.2}, {0.0, 0.2}, {10.0, 1.2}});
  law.axis = {0.0, 2.0, 0.0};
  ASSERT_FALSE(check(law, "here"));
  EXPECT_NEAR(norm(law.axis), 1.0, 1e-15);
  EXPECT_NEAR(law.force_n(2.0, 50.0, {99.0, 5.0, 99.0}), 0.7 * 2.0, 1e-12) << "halfway";
  EXPECT_NEAR(law.force_n(2.0, 0.0, {0.0, -500.0, 0.0}), 0.2 * 2.0, 1e-12);
  EXPECT_NEAR(law.force_n(2.0, 0.0, {0.0, 500.0, 0.0}), 1.2 * 2.0, 1e-12);
  EXPECT_EQ(law.force_n(-1.0, 0.0, {}), 0.0);
}

TEST(TargetLaw, TheGreatestStiffnessIsNeverExceeded) {
  std::mt19937_64 random(41);
  std::uniform_real_distribution<double> value(0.01, 5.0), exponent(1.0, 3.0);
  for (int round = 0; round < 200; ++round) {
    std::vector<TargetLaw> laws{linear_target(value(random)), power_law(value(random), 0.0, exponent(random)),
                                profile(TargetLaw::Kind::kDisplacementProfile,
                                        {{0.5, value(random)}, {1.5, value(random)}, {9.0, value(random)}})};
    for (const TargetLaw& law : laws) {
      const double greatest = greatest_stiffness_n_per_mm(law, 12.0);
      double reached = 0.0;
      for (double x = 0.0; x < 12.0 - 1e-3; x += 0.01) {
        reached = std::max(reached, (law.force_n(x + 1e-3, 0.0, {}) - law.force_n(x, 0.0, {})) / 1e-3);
      }
      ASSERT_LE(reached, greatest * (1.0 + 1e-6));
    }
  }
}

TEST(TargetLaw, CheckNamesWhatIsOutOfRange) {
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
  using Kind = TargetLaw::Kind;
  TargetLaw crowded = profile(Kind::kDisplacementProfile, {{0.0, 1.0}});
  crowded.knot_count = 17;
  TargetLaw without_axis = profile(Kind::kPositionProfile, {{0.0, 1.0}});
  without_axis.axis = {};
  TargetLaw nan_axis = without_axis;
  nan_axis.axis.y = kNan;
  struct Case {
    const char* named;
    TargetLaw law;
  };
  for (Case c : {
           Case{"stiffness_n_per_mm", linear_target(-0.1)},
           Case{"stiffness_n_per_mm", linear_target(1001.0)},
           Case{"stiffness_n_per_mm", linear_target(kNan)},
           Case{"hunt_crossley.stiffness_n_per_mm_m", power_law(-1.0, 0.0, 1.5)},
           Case{"hunt_crossley.stiffness_n_per_mm_m", power_law(kNan, 0.0, 1.5)},
           Case{"hunt_crossley.damping_n_s_per_mm_m1", power_law(1.0, -1.0, 1.5)},
           Case{"hunt_crossley.exponent", power_law(1.0, 0.0, 0.9)},
           Case{"hunt_crossley.exponent", power_law(1.0, 0.0, 3.1)},
           Case{"hunt_crossley.exponent", power_law(1.0, 0.0, kNan)},
           Case{"profile's number of knots", profile(Kind::kDisplacementProfile, {})},
           Case{"profile's number of knots", profile(Kind::kPositionProfile, {})},
           Case{"profile's number of knots", crowded},
           Case{"knot 1, at_mm (rising)", profile(Kind::kDisplacementProfile, {{-1.0, 1.0}})},
           Case{"knot 2, at_mm (rising)", profile(Kind::kDisplacementProfile, {{1.0, 1.0}, {1.0, 2.0}})},
           Case{"knot 3, at_mm (rising)",
                profile(Kind::kPositionProfile, {{-1.0, 1.0}, {2.0, 2.0}, {0.0, 2.0}})},
           Case{"knot 2, at_mm (rising)", profile(Kind::kPositionProfile, {{1.0, 1.0}, {kNan, 2.0}})},
           Case{"knot 1, stiffness_n_per_mm", profile(Kind::kDisplacementProfile, {{1.0, -1.0}})},
           Case{"knot 2, stiffness_n_per_mm", profile(Kind::kPositionProfile, {{1.0, 1.0}, {2.0, kNan}})},
           Case{"axis' length", without_axis},
           Case{"axis' length", nan_axis},
       }) {
    const auto error = check(c.law, "request");
    ASSERT_TRUE(error) << c.named;
    EXPECT_EQ(error->what, std::string(c.named) + " is out of range");
    EXPECT_EQ(error->where, "request");
    EXPECT_FALSE(error->value.empty());
    EXPECT_FALSE(error->limit.empty());
  }
  TargetLaw fine = profile(Kind::kPositionProfile, {{-5.0, 1.0}, {2.0, 2.0}});
  EXPECT_FALSE(check(fine, "request"));
}

}  // namespace
}  // namespace hapticd::rt
