#include "server/pose/motion_predictor.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>

#include "tests/unit/pose/milliseconds.h"

namespace hapticd::pose {
namespace {

constexpr double kResolutionMm = 0.03;

MotionPredictor::Now at(std::int64_t time_ns, const Eigen::Vector3d& position_mm) {
  MotionPredictor::Now now;
  now.time_ns = time_ns;
  now.position_mm = position_mm;
  return now;
}

/// Follows `position(s)` for so long, a tick a millisecond.
template <class Position>
void follow(MotionPredictor& predictor, double seconds, Position position) {
  for (int i = 0; i <= std::lround(1e3 * seconds); ++i) predictor.follow(at(i * kMs, position(1e-3 * i)));
}

TEST(MotionPredictor, WithNothingAheadThePoseIsAsMeasured) {
  MotionPredictor predictor(kResolutionMm);
  follow(predictor, 0.5, [](double s) { return Eigen::Vector3d(200.0 * s, 0.0, 0.0); });
  const PredictedMotion now = predictor.ahead(0.0);
  EXPECT_NEAR(now.position_mm.x(), 100.0, 1e-12);
  EXPECT_EQ(now.error_mm, 0.0);
  EXPECT_EQ(now.error_bound_mm, 0.0);
}

TEST(MotionPredictor, AConstantVelocityIsMetAndItsErrorFallsToTheNoise) {
  MotionPredictor predictor(kResolutionMm);
  follow(predictor, 6.0, [](double s) { return Eigen::Vector3d(20.0 * s, -30.0 * s, 0.0); });
  const PredictedMotion there = predictor.ahead(0.066);
  EXPECT_NEAR(there.position_mm.x(), 20.0 * 6.066, 1e-6);
  EXPECT_NEAR(there.position_mm.y(), -30.0 * 6.066, 1e-6);
  EXPECT_LT(there.error_mm, 0.2) << "after ten memories only the encoders' noise is left";
  EXPECT_GT(there.error_mm, 0.0);
}

TEST(MotionPredictor, OfAConstantAccelerationTheStatedErrorIsTheError) {
  MotionPredictor predictor(0.0);
  constexpr double kAcceleration = 1500.0;
  const auto position = [](double s) { return Eigen::Vector3d(0.0, 0.5 * kAcceleration * s * s, 0.0); };
  follow(predictor, 3.0, position);
  for (const double ahead_s : {0.010, 0.066, 0.100}) {
    const PredictedMotion there = predictor.ahead(ahead_s);
    const double error = (there.position_mm - position(3.0 + ahead_s)).norm();
    EXPECT_NEAR(there.error_mm / error, 1.0, 0.02) << ahead_s;
    EXPECT_NEAR(there.covariance_mm2(1, 1) / (error * error), 1.0, 0.04) << "it is along the motion";
    EXPECT_LT(there.covariance_mm2(0, 0), 1e-3 * there.covariance_mm2(1, 1));
    EXPECT_GT(there.error_bound_mm, error);
  }
}

TEST(MotionPredictor, TheBoundHoldsUpToTheAssumedAcceleration) {
  MotionPredictor predictor(0.0);
  const double kAcceleration = MotionPredictor::kAssumedMmPerS2;
  const auto position = [&](double s) { return Eigen::Vector3d(0.5 * kAcceleration * s * s, 0.0, 0.0); };
  follow(predictor, 0.2, position);
  const PredictedMotion there = predictor.ahead(0.05);
  EXPECT_NEAR((there.position_mm - position(0.25)).norm() / there.error_bound_mm, 1.0, 1e-6);
}

TEST(MotionPredictor, AHandThatGoesBackAndForthIsMetBetterThanNotAtAll) {
  // 200 mm/s at most, 1 Hz; quantised as encoders are.
  const auto position = [](double s) {
    const double x = 200.0 / (2.0 * std::numbers::pi) * std::sin(2.0 * std::numbers::pi * s);
    return Eigen::Vector3d(kResolutionMm * std::round(x / kResolutionMm), 0.0, 0.0);
  };
  MotionPredictor predictor(kResolutionMm);
  double predicted = 0.0, unpredicted = 0.0, stated = 0.0;
  for (int i = 0; i < 8000; ++i) {
    predictor.follow(at(i * kMs, position(1e-3 * i)));
    if (i < 2000) continue;
    const PredictedMotion there = predictor.ahead(0.066);
    const Eigen::Vector3d truth = position(1e-3 * i + 0.066);
    predicted += (there.position_mm - truth).squaredNorm();
    unpredicted += (position(1e-3 * i) - truth).squaredNorm();
    stated += there.error_mm * there.error_mm;
  }
  EXPECT_LT(std::sqrt(predicted / unpredicted), 0.5);
  EXPECT_NEAR(std::sqrt(stated / predicted), 1.0, 0.15);
}

TEST(MotionPredictor, InContactTheNormalPartIsHeldAndTheRestGoesOn) {
  MotionPredictor predictor(kResolutionMm);
  for (int i = 0; i < 100; ++i) {
    MotionPredictor::Now now = at(i * kMs, {0.1 * i, 0.0, -0.05 * i});
    now.normal = Eigen::Vector3d::UnitZ();
    predictor.follow(now);
  }
  const PredictedMotion there = predictor.ahead(0.02);
  EXPECT_TRUE(there.normal_is_held);
  EXPECT_NEAR(there.position_mm.x(), 9.9 + 2.0, 1e-6);
  EXPECT_NEAR(there.position_mm.z(), -4.95, 1e-9);
  EXPECT_GT(there.error_bound_mm, 1.0) << "it may go on inwards";
}

TEST(MotionPredictor, TurnsTheToolByItsAngularVelocity) {
  MotionPredictor predictor(kResolutionMm);
  MotionPredictor::Now now = at(0, Eigen::Vector3d::Zero());
  for (int i = 0; i < 100; ++i) {
    now.time_ns = i * kMs;
    now.orientation = Eigen::Quaterniond(Eigen::AngleAxisd(2e-3 * i, Eigen::Vector3d::UnitX()));
    now.angular_rad_per_s = {2.0, 0.0, 0.0};
    predictor.follow(now);
  }
  const Eigen::Quaterniond truth(Eigen::AngleAxisd(2e-3 * 99 + 0.1, Eigen::Vector3d::UnitX()));
  EXPECT_LT(predictor.ahead(0.05).orientation.angularDistance(truth), 1e-9);
}

TEST(MotionPredictor, ForgetsOverAGapAndBearsWhatIsNoNumber) {
  MotionPredictor predictor(kResolutionMm);
  follow(predictor, 1.0, [](double s) { return Eigen::Vector3d(5000.0 * s * s, 0.0, 0.0); });
  const double before = predictor.ahead(0.05).error_mm;
  predictor.follow(at(1001 * kMs, {std::numeric_limits<double>::quiet_NaN(), 0.0, 0.0}));
  EXPECT_EQ(predictor.ahead(0.05).error_mm, before);
  predictor.follow(at(2000 * kMs, {1.0, 2.0, 3.0}));
  const PredictedMotion there = predictor.ahead(0.05);
  EXPECT_EQ(there.position_mm, Eigen::Vector3d(1.0, 2.0, 3.0)) << "no velocity is known yet";
  EXPECT_TRUE(std::isfinite(there.error_mm));
  EXPECT_LT(there.error_mm, before);
}

}  // namespace
}  // namespace hapticd::pose
