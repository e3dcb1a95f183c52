#include "server/identification/estimate/contact/surface_scan.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>

#include "rt/signal/vector.h"
#include "tests/support/value_of.h"

namespace hapticd::identification {
namespace {

struct Profile {
  double radius_mm = 0.0;  ///< 0: a plane
  double wave_mm = 0.0;
  double tilt = 0.0;
  double height(double s) const {
    const double ball = radius_mm > 0.0 ? std::sqrt(radius_mm * radius_mm - s * s) - radius_mm : 0.0;
    return ball + wave_mm * std::cos(2.0 * M_PI * s / 45.0) + tilt * s;
  }
  double slope(double s) const { return (height(s + 1e-5) - height(s - 1e-5)) / 2e-5; }
};

std::vector<ProfilePoint> touched(const Profile& profile, double noise_mm, unsigned seed) {
  std::mt19937_64 random(seed);
  std::normal_distribution<double> noise(0.0, noise_mm);
  std::vector<ProfilePoint> points;
  for (double s = -23.0; s <= 23.01; s += 2.5) points.push_back({s, profile.height(s) + noise(random)});
  return points;
}

TEST(SurfaceSpline, FindsSlopesAndHowSureTheyAre) {
  for (const Profile& profile :
       {Profile{}, Profile{0.0, 0.0, 0.3}, Profile{40.0, 0.0, 0.0}, Profile{0.0, 1.5, 0.1}}) {
    double squared = 0.0;
    double normed = 0.0;
    int count = 0;
    for (unsigned seed = 0; seed < 40; ++seed) {
      const auto spline = hapticd::test::value_of(SurfaceSpline::fit(touched(profile, 0.02, seed), 0.01));
      for (double s = -18.0; s <= 18.0; s += 3.0) {
        const ProfileValue at = spline.at(s);
        const double error = at.slope - profile.slope(s);
        squared += error * error;
        normed += error * error / (at.slope_error * at.slope_error);
        ++count;
      }
    }
    EXPECT_LT(std::sqrt(squared / count), 0.02) << profile.radius_mm << ' ' << profile.wave_mm;
    EXPECT_LT(std::sqrt(normed / count), 1.7)
        << "standard errors are too small " << profile.radius_mm << ' ' << profile.wave_mm;
    EXPECT_GT(std::sqrt(normed / count), 0.3)
        << "standard errors are too large " << profile.radius_mm << ' ' << profile.wave_mm;
  }
}

TEST(SurfaceSpline, IsExactForWhatItIsMadeOf) {
  std::vector<ProfilePoint> points;
  for (double s = 0.0; s < 20.0; s += 2.0) points.push_back({s, 3.0 - 0.2 * s + 0.01 * s * s});
  const auto spline = hapticd::test::value_of(SurfaceSpline::fit(points, 0.001));
  for (double s = -1.0; s < 20.0; s += 0.37) {
    EXPECT_NEAR(spline.at(s).height_mm, 3.0 - 0.2 * s + 0.01 * s * s, 1e-9);
    EXPECT_NEAR(spline.at(s).slope, -0.2 + 0.02 * s, 1e-9);
  }
}

TEST(SurfaceSpline, NearestPointOfAPressedTip) {
  const Profile ball{40.0, 0.0, 0.0};
  const auto spline = hapticd::test::value_of(SurfaceSpline::fit(touched(ball, 0.0, 1), 0.005));
  for (const double angle : {-0.4, -0.1, 0.0, 0.3}) {
    for (const double depth_mm : {0.0, 2.0, 8.0}) {  // below the surface, towards the centre of the ball
      const double r = 40.0 - depth_mm;
      const auto normal = normal_at(spline, {r * std::sin(angle), 0.0, r * std::cos(angle) - 40.0});
      ASSERT_TRUE(normal);
      EXPECT_NEAR(std::atan2(normal->direction.x, normal->direction.z), angle, 0.01) << depth_mm;
    }
  }
  EXPECT_FALSE(normal_at(spline, {30.0, 0.0, -12.0})) << "far beyond the scan no one knows";
}

TEST(SurfaceSpline, RefusesWhatSaysNoSurface) {
  constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
  EXPECT_FALSE(SurfaceSpline::fit({}, 0.01));
  EXPECT_FALSE(SurfaceSpline::fit({{0, 0}, {1, 0}, {2, 0}, {3, 0}}, 0.01));
  EXPECT_FALSE(SurfaceSpline::fit(std::vector<ProfilePoint>(50, {1.0, 2.0}), 0.01)) << "one place only";
  EXPECT_FALSE(SurfaceSpline::fit({{0, 0}, {1, 0}, {2, kNaN}, {3, 0}, {4, 0}, {5, 0}}, 0.01));
  EXPECT_FALSE(SurfaceSpline::fit(std::vector<ProfilePoint>(5, {kNaN, 0.0}), 0.01));
  const auto flat = SurfaceSpline::fit({{0, 1}, {1, 1}, {2, 1}, {3, 1}, {4, 1}}, 0.01);
  ASSERT_TRUE(flat) << "a constant height is a surface";
  EXPECT_NEAR(flat->at(2.5).slope, 0.0, 1e-9);
  EXPECT_GT(flat->at(2.5).slope_error, 1e-4) << "but not one known without error";
}

/// Taps on a plane at height 0, a tick at a time; the object pushes back with 0.3 N/mm.
class Taps {
 public:
  Taps() {
    info_.device.position_resolution_mm = 0.007;
    info_.sensor.tool_mass_g = 0.0;
  }
  const hal::RigInfo& info() const { return info_; }
  void tap(SurfaceScan& scan, double x_mm, double depth_mm, double drift_mm = 0.0) {
    for (int i = 0; i < 500; ++i) {
      const double phase = static_cast<double>(i) / 500.0;
      const double z = 3.0 - (3.0 + depth_mm) * std::sin(M_PI * phase);
      hal::RigSample sample;
      sample.time_ns = 1'000'000 * ++tick_;
      sample.tip_position_mm = {x_mm + drift_mm * phase, 0.0, z};
      sample.sensor_force_n = {0.0, 0.0, z < 0.0 ? -0.3 * z : 0.0};
      sample.force_count = 1;
      scan.add(sample);
    }
  }

 private:
  hal::RigInfo info_;
  std::int64_t tick_ = 0;
};

TEST(SurfaceScan, CountsLightTapsInPlace) {
  Taps hand;
  SurfaceScan scan(0.02, hand.info());
  for (int i = 0; i < 8; ++i) hand.tap(scan, 2.0 * i, 1.0);
  ASSERT_EQ(scan.touches().size(), 8U);
  for (const ProfilePoint& touch : scan.touches()) EXPECT_NEAR(touch.height_mm, 0.0, 0.2);
  hand.tap(scan, 7.0, 1.0, 8.0);  // slid along
  EXPECT_EQ(scan.touches().size(), 8U);
  hand.tap(scan, 7.0, 8.0);  // pressed hard
  hand.tap(scan, 9.0, 1.0);  // on what has not recovered
  EXPECT_EQ(scan.touches().size(), 8U);
  EXPECT_NEAR(hapticd::test::value_of(scan.surface()).at(7.0).slope, 0.0, 0.02);
}

TEST(SurfaceScan, KeepsNoMoreThanItMay) {
  Taps hand;
  SurfaceScan scan(0.02, hand.info());
  for (int i = 0; i < 300; ++i) hand.tap(scan, 0.1 * (i % 250), 1.0);
  EXPECT_EQ(scan.touched(), 300U);
  EXPECT_EQ(scan.touches().size(), SurfaceScan::kMaxTouches);
  EXPECT_TRUE(scan.surface());
}

}  // namespace
}  // namespace hapticd::identification
