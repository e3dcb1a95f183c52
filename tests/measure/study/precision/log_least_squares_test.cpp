#include "tests/measure/study/precision/log_least_squares.h"

#include <gtest/gtest.h>

#include <cmath>

namespace hapticd::study {
namespace {

TEST(LogLeastSquares, FindsTheLawItsModelDescribes) {
  LogLeastSquares estimator;
  for (int i = 0; i < 200; ++i) {
    const double x = 0.1 + 0.05 * i;
    const double rate = 30.0 * std::sin(0.3 * i);
    estimator.add({x, rate, 0.02 * std::pow(x, 1.7) * std::exp(1e-3 * rate), true, 1e-3 * i});
  }
  const auto estimate = estimator.estimate();
  ASSERT_TRUE(estimate.has_value());
  EXPECT_NEAR(estimate->parameters.stiffness_n_per_mm_m, 0.02, 1e-10);
  EXPECT_NEAR(estimate->parameters.exponent, 1.7, 1e-10);
  EXPECT_NEAR(estimate->parameters.damping_n_s_per_mm_m1, 2e-5, 1e-12);
}

TEST(LogLeastSquares, TellsNothingOfOneDepth) {
  LogLeastSquares resting, moving;
  for (int i = 0; i < 100; ++i) {
    resting.add({1.0, 0.0, 0.5, true, 1e-3 * i});
    moving.add({2.0, std::sin(0.3 * i), 0.5, true, 1e-3 * i});
  }
  EXPECT_FALSE(resting.estimate().has_value());
  EXPECT_FALSE(moving.estimate().has_value());
}

TEST(LogLeastSquares, LeavesOutWhatIsNoContact) {
  LogLeastSquares estimator;
  for (int i = 0; i < 100; ++i) estimator.add({1.0 + i, 0.0, 0.5 + i, false, 1e-3 * i});
  EXPECT_FALSE(estimator.estimate().has_value());
}

}  // namespace
}  // namespace hapticd::study
