#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cmath>
#include <limits>
#include <random>

#include "contact_synthetic.h"
#include "server/identification/estimate/contact/contact_creep_fit.h"
#include "server/identification/estimate/contact/contact_estimate.h"
#include "server/identification/estimate/contact/contact_single_stage.h"
#include "server/identification/estimate/contact/contact_surface.h"
#include "server/identification/estimate/contact/contact_variable_projection.h"
#include "tests/reference/contact_double_stage.h"
#include "tests/reference/contact_point.h"
#include "tests/support/value_of.h"

namespace hapticd::identification {
namespace {

using namespace test;

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

template <class Estimator>
std::optional<HuntCrossleyEstimate> fed(Estimator estimator, const std::vector<PalpationSample>& palpation) {
  for (const PalpationSample& s : palpation) estimator.add(s);
  return estimator.estimate();
}

// --- single stage ---

TEST(ContactSingleStage, IsRecursiveLeastSquaresInTheTextbooksForm) {
  const rt::HuntCrossleyParameters law{0.4, 2e-4, 1.4};  // |B/K·ẋ| < 0.1 throughout: the gates leave all in
  for (const double lambda : {1.0, 0.999}) {
    SingleStageEstimator estimator({.min_share = 0.0, .forgetting = lambda, .mean_of = 1});
    // L = Pφ/(λ/w + φᵀPφ), from no knowledge at all.
    Eigen::Matrix3d covariance = 1e9 * Eigen::Matrix3d::Identity();
    Eigen::Vector3d theta = Eigen::Vector3d::Zero();
    for (const PalpationSample& s : synthetic_palpation(law, 6.0, 0.02)) {
      estimator.add(s);
      if (!s.in_contact || s.normal_force_n <= 0.1 || s.displacement_mm <= 1.0 / 128.0) continue;
      const Eigen::Vector3d phi(1.0, std::log(s.displacement_mm), s.rate_mm_per_s);
      const double weight = s.normal_force_n * s.normal_force_n;
      const Eigen::Vector3d gain = covariance * phi / (lambda / weight + phi.dot(covariance * phi));
      theta += gain * (std::log(s.normal_force_n) - phi.dot(theta));
      covariance = (covariance - gain * phi.transpose() * covariance) / lambda;
    }
    const auto estimate = value_of(estimator.estimate());
    const rt::HuntCrossleyParameters& p = estimate.parameters;
    EXPECT_NEAR(std::log(p.stiffness_n_per_mm_m), theta(0), 1e-5) << lambda;
    EXPECT_NEAR(p.exponent, theta(1), 1e-5) << lambda;
    EXPECT_NEAR(p.damping_n_s_per_mm_m1 / p.stiffness_n_per_mm_m, theta(2), 1e-7) << lambda;
  }
}

TEST(ContactSingleStage, FindsLawsUnderNoise) {
  struct Case {
    rt::HuntCrossleyParameters law;
    double depth_mm;
  };
  for (const Case& c :
       {Case{{0.0059, 1e-5, 2.1}, 18.0}, Case{{0.3, 1e-4, 1.3}, 6.0}, Case{{2.0, 1e-3, 1.5}, 2.0},
        Case{{0.5, 0.0, 1.0}, 5.0}, Case{{0.01, 2e-5, 3.0}, 8.0}}) {
    const auto estimate = fed(SingleStageEstimator(), synthetic_palpation(c.law, c.depth_mm, 0.010));
    ASSERT_TRUE(estimate) << "m " << c.law.exponent;
    EXPECT_LT(law_displacement_error(c.law, estimate->parameters, c.depth_mm), 0.02)
        << "m " << c.law.exponent;
    EXPECT_NEAR(estimate->parameters.exponent, c.law.exponent, 0.04);
    EXPECT_NEAR(estimate->parameters.damping_n_s_per_mm_m1 / estimate->parameters.stiffness_n_per_mm_m,
                c.law.damping_n_s_per_mm_m1 / c.law.stiffness_n_per_mm_m, 4e-4);
  }
}

TEST(ContactSingleStage, ItsGateOfDisplacementActsOnWhatWasSeenBefore) {
  const rt::HuntCrossleyParameters law{0.1, 0.0, 1.8};
  SingleStageEstimator estimator;
  // At first the skin alone, ten times as stiff; it is below a tenth of what is pressed later.
  for (const PalpationSample& s : synthetic_palpation({3.0, 0.0, 1.0}, 0.7)) estimator.add(s);
  for (const PalpationSample& s : synthetic_palpation(law, 10.0)) estimator.add(s);
  const auto estimate = value_of(estimator.estimate());
  EXPECT_NEAR(estimate.parameters.exponent, 1.8, 0.01);
  EXPECT_NEAR(estimate.parameters.stiffness_n_per_mm_m, 0.1, 0.003);
}

TEST(ContactSingleStage, SurvivesWhatIsNoPalpation) {
  SingleStageEstimator estimator;
  PalpationSample s{3.0, 0.0, 1.5, true};
  for (int i = 0; i < 100'000; ++i) estimator.add(s);
  EXPECT_FALSE(estimator.estimate()) << "held at one force: not determined";
  for (const double bad : {kNan, std::numeric_limits<double>::infinity()}) {
    estimator.add({bad, 0.0, 1.0, true});
    estimator.add({1.0, bad, 1.0, true});
    estimator.add({1.0, 0.0, bad, true});
    estimator.add({1.0, 0.0, -bad, true});
  }
  estimator.add({1.0, 0.0, 1e3, false});  // frozen out of contact
  const auto good = synthetic_palpation({0.2, 0.0, 1.5}, 5.0);
  for (const PalpationSample& g : good) estimator.add(g);
  ASSERT_TRUE(estimator.estimate());
  EXPECT_TRUE(std::isfinite(estimator.estimate()->parameters.stiffness_n_per_mm_m));
}

TEST(ContactSingleStage, ForgetsWithoutWindingUp) {
  SingleStageEstimator estimator({.forgetting = 0.995});
  for (const PalpationSample& s : synthetic_palpation({0.3, 0.0, 1.2}, 6.0)) estimator.add(s);
  // Weights grow by 0.995 per mean: four million of them pass 1e100 and are rescaled, over and over.
  const auto later = synthetic_palpation({0.1, 0.0, 1.7}, 6.0, 0.005);
  for (int round = 0; round < 60; ++round) {
    for (const PalpationSample& s : later) estimator.add(s);
  }
  EXPECT_LT(law_displacement_error({0.1, 0.0, 1.7}, value_of(estimator.estimate()).parameters, 6.0), 0.02);
}

// --- double stage ---

TEST(ContactDoubleStage, FindsLawsAndKeepsItsCovarianceBounded) {
  for (const rt::HuntCrossleyParameters& law :
       {rt::HuntCrossleyParameters{0.3, 3e-4, 1.3}, {0.02, 2e-5, 2.1}, {0.5, 0.0, 1.0}}) {
    DoubleStageEstimator estimator;
    for (int round = 0; round < 2; ++round) {
      for (const PalpationSample& s : synthetic_palpation(law, 8.0, 0.01)) estimator.add(s);
    }
    const auto estimate = value_of(estimator.estimate());
    EXPECT_LT(law_displacement_error(law, estimate.parameters, 8.0), 0.03) << "m " << law.exponent;
    // Hours of one force excite nothing; forgetting alone would blow the covariance up.
    for (int i = 0; i < 500'000; ++i)
      estimator.add({3.0, 0.0, rt::hunt_crossley_force_n(law, 3.0, 0.0), true});
    EXPECT_LE(estimator.covariance_share(), 1.0);
    ASSERT_TRUE(estimator.estimate());
    EXPECT_NEAR(rt::hunt_crossley_force_n(estimator.estimate()->parameters, 3.0, 0.0) /
                    rt::hunt_crossley_force_n(law, 3.0, 0.0),
                1.0, 0.02);
  }
}

// --- variable projection ---

TEST(ContactVariableProjection, IsExactWhereNothingDisturbs) {
  for (const rt::HuntCrossleyParameters& law :
       {rt::HuntCrossleyParameters{0.3, 3e-3, 1.3}, {0.02, 2e-5, 2.1}, {0.5, 0.0, 1.0}, {0.01, 1e-4, 3.0}}) {
    const auto estimate = value_of(fit_by_variable_projection(synthetic_palpation(law, 6.0)));
    EXPECT_NEAR(estimate.parameters.exponent, law.exponent, 2e-5);
    EXPECT_NEAR(estimate.parameters.stiffness_n_per_mm_m / law.stiffness_n_per_mm_m, 1.0, 1e-4);
    EXPECT_NEAR(estimate.parameters.damping_n_s_per_mm_m1, law.damping_n_s_per_mm_m1,
                1e-4 * law.stiffness_n_per_mm_m);
  }
}

TEST(ContactVariableProjection, FindsTheContactOffset) {
  const rt::HuntCrossleyParameters law{0.2, 1e-4, 1.6};
  auto palpation = synthetic_palpation(law, 6.0, 0.003);
  for (PalpationSample& s : palpation) s.displacement_mm -= 0.25;  // the zero is a preload behind the surface
  const auto estimate = value_of(fit_by_variable_projection(palpation, {-0.6, 0.6, 30}));
  EXPECT_NEAR(estimate.contact_offset_mm, 0.25, 0.02);
  EXPECT_NEAR(estimate.parameters.exponent, 1.6, 0.02);
  const auto uncertainty = hunt_crossley_uncertainty(estimate, palpation, true);
  EXPECT_LT(uncertainty.contact_offset_mm, 0.05);
  EXPECT_GT(uncertainty.contact_offset_mm, 1e-4);
}

TEST(ContactVariableProjection, NeverDampsNegatively) {
  auto palpation = synthetic_palpation({0.2, 0.0, 1.5}, 6.0);
  for (PalpationSample& s : palpation) s.normal_force_n *= 1.0 - 1e-3 * s.rate_mm_per_s;  // gives energy
  const auto estimate = value_of(fit_by_variable_projection(palpation));
  EXPECT_EQ(estimate.parameters.damping_n_s_per_mm_m1, 0.0);
  EXPECT_TRUE(std::isinf(hunt_crossley_uncertainty(estimate, palpation, false).damping_n_s_per_mm_m1));
}

TEST(ContactVariableProjection, TellsWhatItCannotTell) {
  EXPECT_FALSE(fit_by_variable_projection({}));
  EXPECT_FALSE(
      fit_by_variable_projection(std::vector<PalpationSample>(1000, PalpationSample{3.0, 0.0, 1.5, true})));
  EXPECT_FALSE(fit_by_variable_projection(
      std::vector<PalpationSample>(1000, PalpationSample{kNan, kNan, kNan, true})));
}

// --- standard errors ---

TEST(ContactUncertainty, IsTheScatterOverSeedsThoughErrorsHangTogether) {
  const rt::HuntCrossleyParameters law{0.25, 5e-4, 1.5};
  for (const double correlation_s : {0.0, 0.05}) {
    double reported = 0.0, sum = 0.0, squares = 0.0, reported_force = 0.0, sum_force = 0.0,
           squares_force = 0.0;
    constexpr int kSeeds = 40;
    for (int seed = 0; seed < kSeeds; ++seed) {
      const auto palpation =
          synthetic_palpation(law, 6.0, 0.05, correlation_s, static_cast<std::uint64_t>(seed) + 1);
      const auto estimate = value_of(fit_by_variable_projection(palpation));
      const auto uncertainty = hunt_crossley_uncertainty(estimate, palpation, false);
      reported += uncertainty.exponent / kSeeds;
      reported_force += uncertainty.relative_force / kSeeds;
      const double m = estimate.parameters.exponent;
      sum += m / kSeeds;
      squares += m * m / kSeeds;
      const double f =
          rt::hunt_crossley_force_n(estimate.parameters, 6.0, 0.0) / rt::hunt_crossley_force_n(law, 6.0, 0.0);
      sum_force += f / kSeeds;
      squares_force += f * f / kSeeds;
    }
    const double scatter = std::sqrt(squares - sum * sum);
    const double scatter_force = std::sqrt(squares_force - sum_force * sum_force);
    EXPECT_GT(reported / scatter, 0.6) << correlation_s;
    EXPECT_LT(reported / scatter, 1.7) << correlation_s;
    EXPECT_GT(reported_force / scatter_force, 0.6) << correlation_s;
    EXPECT_LT(reported_force / scatter_force, 1.7) << correlation_s;
    EXPECT_NEAR(sum, law.exponent, 3.0 * scatter / std::sqrt(kSeeds) + 1e-4);
  }
}

TEST(ContactUncertainty, IsInfiniteWhereNothingIsReported) {
  const HuntCrossleyEstimate estimate{{0.2, 0.0, 1.5}, 0.0, 1000};
  const std::vector<PalpationSample> held(1000, PalpationSample{3.0, 0.0, 1.0, true});
  EXPECT_TRUE(std::isinf(hunt_crossley_uncertainty(estimate, held, false).exponent));
  EXPECT_TRUE(std::isnan(hunt_crossley_uncertainty(estimate, {}, false).residual));
}

// --- creep law ---

/// Presses and holds of changing force on a creep law's object.
PalpationSample creep_sample(rt::CreepLaw& law, int i, double noise_mm) {
  const double t = 1e-3 * i;
  double force_n = std::max(0.0, (1.2 + 0.8 * std::sin(0.7 * t)) * std::sin(2.5 * t));
  if (std::fmod(t, 24.0) > 14.0 && std::fmod(t, 24.0) < 18.0) force_n = 1.5;
  PalpationSample s;
  s.displacement_mm =
      law.update(force_n).displacement_mm + noise_mm * std::sin(311.0 * t) * std::cos(97.0 * t);
  s.in_contact = force_n > 0.0;
  s.normal_force_n = force_n;
  s.time_s = t;
  return s;
}

TEST(ContactCreepFit, FindsTheLawInBoundedMemoryAndSaysItsErrors) {
  const rt::CreepParameters truth = some_creep();
  rt::CreepLaw law(truth, 1000.0);
  CreepFit fit(truth.time_s, 3, 2048);
  for (int i = 0; i < 200'000; ++i) {
    fit.add(creep_sample(law, i, 0.02), 1e-3);
    ASSERT_LE(fit.rows().size(), 2048U);
  }
  const auto estimate = value_of(fit.solve());
  for (std::size_t j = 0; j < truth.weight.size(); ++j) {
    EXPECT_NEAR(estimate.law.parameters.weight[j], truth.weight[j], 0.05) << j;
    EXPECT_GT(estimate.weight_error[j], 0.0) << j;
    EXPECT_LT(estimate.weight_error[j], 0.1) << j;
  }
  EXPECT_LT(estimate.relative_displacement, 0.02);
  EXPECT_LT(estimate.residual, 0.02);
}

// The palpation is forgotten, and one depth says nothing about an exponent, however rounding falls.
TEST(SingleStage, ClaimsNothingOfADepthThatIsHeld) {
  SingleStageEstimator estimator({.forgetting = 0.9997});
  for (const PalpationSample& s : synthetic_palpation({0.4, 4e-4, 1.5}, 4.0, 0.003)) estimator.add(s);
  ASSERT_TRUE(estimator.estimate().has_value());
  std::mt19937_64 random(2);
  std::normal_distribution<double> noise(0.0, 0.003);
  for (int i = 0; i < 1'500'000; ++i) {
    estimator.add({2.4, 0.0, 1.5 + noise(random), true, 1e-3 * i});
    if (i > 500'000 && i % 1000 == 0) {
      ASSERT_FALSE(estimator.estimate().has_value()) << i;
    }
  }
}

// One force and one depth are explained to the last bit, and the search must end all the same.
TEST(CreepFit, EndsOnDataThatLeaveNothing) {
  CreepFit fit(rt::CreepParameters{}.time_s);
  for (int i = 0; i < 60'000; ++i) fit.add({3.0, 0.0, 2.0, true, 1e-3 * i}, 1e-3);
  const auto found = fit.solve();
  ASSERT_TRUE(found.has_value());
  EXPECT_NEAR(rt::CreepLaw(found->law.parameters, 1000.0).curve(2.0).displacement_mm, 3.0, 0.03);
}

TEST(ContactCreepFit, TellsWhatItCannotTell) {
  CreepFit fit(rt::CreepParameters{}.time_s);
  EXPECT_FALSE(fit.solve());
  for (int i = 0; i < 10'000; ++i) fit.add({kNan, 0.0, kNan, true}, 1e-3);
  EXPECT_FALSE(fit.solve());
  for (int i = 0; i < 10'000; ++i) fit.add({-1.0, 0.0, 0.0, false}, 1e-3);
  EXPECT_FALSE(fit.solve());
}

TEST(ContactCreepFit, TakesTimesThatASlowRecordingResolves) {
  EXPECT_EQ(creep_times_s(1e-3), rt::CreepParameters{}.time_s);
  const auto slow = creep_times_s(0.1);
  EXPECT_NEAR(slow.front(), 1.0, 1e-9);
  EXPECT_NEAR(slow.back(), 100.0, 1e-9);
}

// --- series, surface, contact point ---

TEST(ContactThinnedSeries, StaysBoundedAndEvenlySpread) {
  ThinnedSeries<int> series(100);
  for (int i = 0; i < 1'000'000; ++i) {
    series.add(i);
    ASSERT_LE(series.items().size(), 100U);
  }
  const auto stride = static_cast<int>(series.stride());
  for (std::size_t i = 0; i < series.items().size(); ++i)
    EXPECT_EQ(series.items()[i], static_cast<int>(i) * stride);
  EXPECT_GE(series.items().size(), 50U);
  EXPECT_EQ(series.added(), 1'000'000U);
}

TEST(ContactSurface, LiesWhereTheFirstLoadingPoints) {
  std::vector<PalpationSample> palpation;
  for (int i = 0; i < 200; ++i) {
    const double x = 0.02 * i;
    palpation.push_back({x, 0.2, 0.09 * (x + 0.15), true});  // a preload at x = 0
  }
  EXPECT_NEAR(value_of(surface_from_first_loading(palpation)).surface_mm, -0.15, 1e-9);
  EXPECT_FALSE(surface_from_first_loading({}));
  EXPECT_FALSE(
      surface_from_first_loading(std::vector<PalpationSample>(100, PalpationSample{1.0, 0.0, 0.1, true})));
}

TEST(ContactApproach, DriftIsNoContactAndTheContactPointIsWithinItsUncertainty) {
  std::mt19937_64 random(3);
  std::normal_distribution<double> noise(0.0, 0.0015);
  constexpr double kSurfaceMm = 42.0;
  ApproachDetector detector(0.015);
  std::vector<ApproachSample> approach;
  std::vector<std::size_t> declared;
  for (int i = 0; i < 9000; ++i) {
    const double t = 1e-3 * i;
    const double depth = 6.0 * t;
    const double force = 2e-3 * t + 0.05 * std::pow(std::max(0.0, depth - kSurfaceMm), 1.5) + noise(random);
    approach.push_back({t, depth, force});
    if (detector.update(approach.back())) declared.push_back(approach.size() - 1);
  }
  ASSERT_EQ(declared.size(), 1U);
  EXPECT_GT(approach[declared[0]].depth_mm, kSurfaceMm);
  EXPECT_LT(approach[declared[0]].depth_mm, kSurfaceMm + 1.0);
  const auto point = value_of(find_contact_point(approach, declared[0]));
  EXPECT_NEAR(point.depth_mm, kSurfaceMm, 2.0 * point.standard_error_mm);
  EXPECT_LT(point.standard_error_mm, 0.5);
  EXPECT_FALSE(find_contact_point(approach, approach.size()));
}

}  // namespace
}  // namespace hapticd::identification
