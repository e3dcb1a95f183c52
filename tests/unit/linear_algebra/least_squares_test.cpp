#include "server/linear_algebra/least_squares.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <vector>

namespace hapticd::linear_algebra {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

VectorXd vector(std::initializer_list<double> values) {
  VectorXd v(static_cast<Eigen::Index>(values.size()));
  std::copy(values.begin(), values.end(), v.begin());
  return v;
}

/// Minimises |residuals(p)|² with central differences, without bounds.
struct Descent {
  std::function<VectorXd(const VectorXd&)> residuals;
  StopRule stop = {};
  std::vector<double> costs = {};  ///< at each linearisation

  Minimum<VectorXd> from(const VectorXd& start) {
    return minimise(
        start,
        [&](const VectorXd& p) {
          NormalEquations equations(p.size());
          equations.add(central_differences([&](const VectorXd& step) { return residuals(p + step); },
                                            VectorXd::Constant(p.size(), 1e-6)),
                        residuals(p));
          costs.push_back(equations.cost);
          return equations;
        },
        [&](const VectorXd& p) { return residuals(p).squaredNorm(); },
        [](const VectorXd& p, const VectorXd& step) { return VectorXd(p + step); }, stop);
  }
};

VectorXd rosenbrock(const VectorXd& p) {
  return vector({10.0 * (p[1] - p[0] * p[0]), 1.0 - p[0]});
}

TEST(LeastSquares, FindsTheMinimumThroughACurvedValleyAndNeverRises) {
  Descent descent{rosenbrock};
  const auto found = descent.from(vector({-1.2, 1.0}));
  EXPECT_TRUE(found.converged);
  EXPECT_LT((found.state - vector({1.0, 1.0})).norm(), 1e-9);
  for (std::size_t i = 1; i < descent.costs.size(); ++i) EXPECT_LT(descent.costs[i], descent.costs[i - 1]);
  EXPECT_EQ(found.equations.cost, descent.costs.back()) << "the last linearisation is at the state returned";
}

/// y = a exp(b x) with an error that is left: Gauss and Newton's own convergence is linear there.
TEST(LeastSquares, LeavesNoSlopeWhereResidualsRemain) {
  Descent descent{[](const VectorXd& p) {
    VectorXd r(6);
    for (int i = 0; i < 6; ++i)
      r[i] = p[0] * std::exp(p[1] * i) - (2.0 * std::exp(0.3 * i) + (i % 2 == 0 ? 0.2 : -0.2));
    return r;
  }};
  const auto found = descent.from(vector({1.0, 0.0}));
  EXPECT_TRUE(found.converged);
  EXPECT_LT(std::abs(found.equations.right[0]), 1e-4 * found.equations.information(0, 0));
  EXPECT_LT(std::abs(found.equations.right[1]), 1e-4 * found.equations.information(1, 1));
  EXPECT_GT(found.equations.cost, 0.1);
}

TEST(LeastSquares, UnknownsThatTheResidualsDoNotShowStay) {
  Descent descent{[](const VectorXd& p) { return vector({p[0] - 3.0, 2.0 * p[0] - 6.0}); }};
  const auto found = descent.from(vector({0.0, 7.0}));
  EXPECT_TRUE(found.converged);
  EXPECT_NEAR(found.state[0], 3.0, 1e-9);
  EXPECT_EQ(found.state[1], 7.0);
}

TEST(LeastSquares, OfAValleyWithoutAnEndTheNearestPlaceIsTaken) {
  // Only the sum of the two is determined; their units differ by a million.
  Descent descent{[](const VectorXd& p) {
    return vector({p[0] + 1e6 * p[1] - 2.0, 3.0 * (p[0] + 1e6 * p[1] - 2.0)});
  }};
  const auto found = descent.from(vector({0.0, 0.0}));
  EXPECT_TRUE(found.converged);
  EXPECT_NEAR(found.state[0], 1.0, 1e-3);
  EXPECT_NEAR(1e6 * found.state[1], 1.0, 1e-3);
}

TEST(LeastSquares, AnExactStartIsConverged) {
  Descent descent{rosenbrock};
  const auto found = descent.from(vector({1.0, 1.0}));
  EXPECT_TRUE(found.converged);
  EXPECT_EQ(descent.costs.size(), 1U);
}

TEST(LeastSquares, AStartThatIsNotFiniteComesBackNotConverged) {
  Descent descent{[](const VectorXd& p) { return vector({std::sqrt(p[0]), 1.0}); }};
  const auto found = descent.from(vector({-1.0}));
  EXPECT_FALSE(found.converged);
  EXPECT_EQ(found.state[0], -1.0);
}

TEST(LeastSquares, AStepToWhereTheCostIsNotFiniteIsRefused) {
  // The full step from 5 leads below zero, where the logarithm ends.
  Descent descent{[](const VectorXd& p) { return vector({std::log(p[0])}); }};
  const auto found = descent.from(vector({5.0}));
  EXPECT_TRUE(found.converged);
  EXPECT_NEAR(found.state[0], 1.0, 1e-6);
}

TEST(LeastSquares, SlopesThatAreNotFiniteEndItWhereItIs) {
  Descent descent{[](const VectorXd& p) { return vector({p[0] == 2.0 ? 1.0 : kNan}); }};
  const auto found = descent.from(vector({2.0}));
  EXPECT_FALSE(found.converged);
  EXPECT_EQ(found.state[0], 2.0);
}

TEST(LeastSquares, AfterTheLastIterationItIsNotConverged) {
  Descent descent{rosenbrock, {.max_iterations = 3}};
  EXPECT_FALSE(descent.from(vector({-1.2, 1.0})).converged);
  EXPECT_EQ(descent.costs.size(), 4U);
}

TEST(LeastSquares, AGainThatIsSmallEnoughEndsIt) {
  Descent descent{[](const VectorXd& p) { return vector({p[0] - 3.0}); }, {.gain = 1e9}};
  EXPECT_TRUE(descent.from(vector({0.0})).converged);
  EXPECT_EQ(descent.costs.size(), 2U) << "one step is taken";
}

TEST(LeastSquares, BoundsAreThoseOfTheMove) {
  const auto residuals = [](const VectorXd& p) { return VectorXd(p - vector({3.0, 4.0})); };
  const auto found = minimise(
      vector({0.0, 0.0}),
      [&](const VectorXd& p) {
        NormalEquations equations(2);
        equations.add(MatrixXd::Identity(2, 2), residuals(p));
        return equations;
      },
      [&](const VectorXd& p) { return residuals(p).squaredNorm(); },
      [](const VectorXd& p, const VectorXd& step) {
        return VectorXd((p + step).cwiseMin(vector({1.0, 9.0})));
      });
  EXPECT_TRUE(found.converged);
  EXPECT_EQ(found.state[0], 1.0);
  EXPECT_NEAR(found.state[1], 4.0, 1e-5);
}

/// The mean of numbers of which one is far off: weights that are chosen at each linearisation.
TEST(LeastSquares, WeightsMayChangeWithEveryLinearisation) {
  const std::vector<double> seen{1.0, 1.1, 0.9, 1.05, 0.95, 50.0};
  std::vector<double> weights(seen.size());
  const auto found = minimise(
      10.0,
      [&](double mean) {
        NormalEquations equations(1);
        for (std::size_t i = 0; i < seen.size(); ++i) {
          weights[i] = soft_l1((seen[i] - mean) / 0.1);
          equations.add(MatrixXd::Constant(1, 1, -1.0), vector({seen[i] - mean}), weights[i]);
        }
        return equations;
      },
      [&](double mean) {
        double cost = 0.0;
        for (std::size_t i = 0; i < seen.size(); ++i) cost += weights[i] * std::pow(seen[i] - mean, 2);
        return cost;
      },
      [](double mean, const VectorXd& step) { return mean + step[0]; });
  EXPECT_TRUE(found.converged);
  EXPECT_NEAR(found.state, 1.0, 0.05);
}

TEST(CentralDifferences, AreOfSecondOrder) {
  const auto error = [](double h) {
    const MatrixXd slope = central_differences(
        [](const VectorXd& step) { return vector({std::exp(1.0 + step[0])}); }, vector({h}));
    return slope(0, 0) / std::exp(1.0) - 1.0;
  };
  EXPECT_NEAR(error(1e-2), 1e-4 / 6.0, 1e-8);
  EXPECT_NEAR(error(1e-3), 1e-6 / 6.0, 1e-10);
}

TEST(ScaledSystem, LeavesOutWhatHasNoDiagonal) {
  MatrixXd a = MatrixXd::Zero(3, 3);
  a(0, 0) = 1e-12;
  a(2, 2) = 1e12;
  a(0, 2) = a(2, 0) = 0.5;
  const VectorXd x = solve_scaled(a, vector({1e-12, 0.0, 0.5}));
  EXPECT_NEAR(x[0], 1.0, 1e-12);
  EXPECT_EQ(x[1], 0.0);
  EXPECT_NEAR(x[2], 0.0, 1e-24);
  const MatrixXd inverse = invert_scaled(a);
  EXPECT_EQ(inverse.row(1).cwiseAbs().maxCoeff(), 0.0);
  EXPECT_NEAR((inverse * a)(0, 0), 1.0, 1e-12);
  EXPECT_NEAR((inverse * a)(2, 2), 1.0, 1e-12);
}

TEST(RobustWeights, FallWithTheResidual) {
  EXPECT_EQ(soft_l1(0.0), 1.0);
  EXPECT_NEAR(soft_l1(1e3) * 1e3, 1.0, 1e-6);
  EXPECT_EQ(tukey(0.0, 6.0), 1.0);
  EXPECT_EQ(tukey(3.0, 6.0), 0.5625);
  EXPECT_EQ(tukey(-3.0, 6.0), 0.5625);
  EXPECT_EQ(tukey(6.0, 6.0), 0.0);
  EXPECT_EQ(tukey(60.0, 6.0), 0.0);
  EXPECT_EQ(tukey(kNan, 6.0), 0.0);
}

}  // namespace
}  // namespace hapticd::linear_algebra
