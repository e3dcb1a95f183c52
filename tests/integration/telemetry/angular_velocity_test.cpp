#include "server/telemetry/angular_velocity.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "hal/geometry.h"

namespace hapticd::server {
namespace {

constexpr std::int64_t kMs = 1'000'000;

hal::Quaternion about_z(double rad) {
  return {std::cos(0.5 * rad), 0.0, 0.0, std::sin(0.5 * rad)};
}

TEST(AngularVelocity, OfASteadyTurnIsTheTurn) {
  constexpr double kRadPerS = 2.5;
  AngularVelocity velocity;
  hal::Vector3 last;
  std::int64_t time_ns = 5 * kMs;
  for (int i = 0; i < 3000; ++i) {  // more than a whole turn, at uneven times
    time_ns += i % 3 == 0 ? 3 * kMs : kMs / 2;
    const double sign = i % 2 == 0 ? 1.0 : -1.0;  // both quaternions are the same rotation
    const hal::Quaternion q = about_z(kRadPerS * 1e-9 * static_cast<double>(time_ns));
    last = velocity.follow({sign * q.w, sign * q.x, sign * q.y, sign * q.z}, time_ns);
  }
  EXPECT_NEAR(last.z, kRadPerS, 1e-6);
  EXPECT_NEAR(last.x, 0.0, 1e-9);
  EXPECT_NEAR(last.y, 0.0, 1e-9);
}

TEST(AngularVelocity, FollowsAStepWithItsLagWhateverTheRate) {
  for (const std::int64_t period_ns : {kMs / 5, kMs, 4 * kMs}) {
    AngularVelocity velocity;
    velocity.follow({}, 0);
    hal::Vector3 last;
    const auto lag_ns = static_cast<std::int64_t>(1e9 * AngularVelocity::kLagS);
    for (std::int64_t time_ns = period_ns; time_ns <= lag_ns; time_ns += period_ns) {
      last = velocity.follow(about_z(1e-9 * static_cast<double>(time_ns)), time_ns);
    }
    EXPECT_NEAR(last.z, 1.0 - std::exp(-1.0), 1e-6) << period_ns;
  }
}

TEST(AngularVelocity, BeginsAgainAfterAGapAndBearsWhatIsNoRotation) {
  AngularVelocity velocity;
  velocity.follow({}, 0);
  const double before = velocity.follow(about_z(0.01), kMs).z;
  EXPECT_GT(before, 0.0);
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(velocity.follow({nan, 0.0, 0.0, 0.0}, 2 * kMs).z, before);
  EXPECT_EQ(velocity.follow(about_z(1.0), 500 * kMs).z, 0.0);
  EXPECT_EQ(velocity.follow(about_z(2.0), 400 * kMs).z, 0.0) << "time ran backwards";
  EXPECT_TRUE(std::isfinite(velocity.follow({0.0, 0.0, 0.0, 0.0}, 401 * kMs).z));
}

}  // namespace
}  // namespace hapticd::server
