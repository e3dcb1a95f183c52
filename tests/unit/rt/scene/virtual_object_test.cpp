#include <gtest/gtest.h>

#include <cmath>

#include "rt/scene/surface_map.h"
#include "rt/scene/wall_surface.h"
#include "tests/unit/rt/scene/pipeline_bench.h"

namespace hapticd::rt {
namespace {

TEST(WallPipeline, IsAOneSidedSpring) {
  SceneSpec spec = rigid(0.5);
  spec.kind = SceneKind::kWall;
  Bench bench(spec);
  EXPECT_EQ(bench.press(-5.0, -0.1, 0.0, 500).device_command_n.z, 0.0);
  const TickRecord inside = bench.press(-0.1, 4.0, 0.0, 2000);
  EXPECT_NEAR(inside.device_command_n.z, 2.0, 0.02);
  EXPECT_FALSE(inside.channels & channel::kMotion);
  EXPECT_NEAR(bench.press(4.0, -1.0, 0.0, 500).device_command_n.z, 0.0, 1e-12);
}

TEST(WallPipeline, IsSofterToTheEncodersWhereTheStructureIs) {
  const auto command_n = [](bool with_field) {
    SceneSpec spec;
    spec.kind = SceneKind::kWall;
    spec.target.stiffness_n_per_mm = 1.0;
    spec.structural_stiffness_n_per_mm = 2.5;
    StructuralModel field;
    field.stiffness_n_per_mm = 2.5;
    field.gradient_per_mm = {0.0, 0.0, -0.1};  // 1.25 times the compliance at the place of the press
    if (with_field) spec.structural_field = field;
    Bench bench(spec);
    bench.press(-5.0, -0.1, 0.0, 500);
    bench.press(-0.1, 2.5, 0.0, 2000);
    return bench.press(2.5, 2.5, 0.0, 500).device_command_n.z;
  };
  EXPECT_NEAR(command_n(false), 2.5 / (1.0 - 1.0 / 2.5), 0.01);
  EXPECT_NEAR(command_n(true), 2.5 / (1.0 - 1.25 / 2.5), 0.01);
}

TEST(WallPipeline, ABallPushesAlongItsNormalWhereverItIsTouched) {
  SceneSpec spec = rigid(0.5);
  spec.kind = SceneKind::kWall;
  spec.wall_ball = {{0.0, 0.0, -25.0}, 25.0};
  Bench bench(spec);
  const hal::Vector3 centre_mm{0.0, 0.0, -25.0};
  for (const double slant : {0.0, 0.6, 1.4}) {
    const hal::Vector3 outward{std::sin(slant), 0.0, std::cos(slant)};
    const auto at = [&](double distance_mm) {
      hal::RigSample sample = bench.at_depth(0.0, 0.0);
      sample.tip_position_mm = centre_mm + outward * distance_mm;
      return sample;
    };
    TickRecord record;
    for (int i = 0; i < 300; ++i) record = bench.tick(at(30.0));
    EXPECT_EQ(dot(record.device_command_n, record.device_command_n), 0.0);
    for (int i = 0; i < 1000; ++i) record = bench.tick(at(30.0 - 0.009 * i));
    for (int i = 0; i < 500; ++i) record = bench.tick(at(21.0));
    EXPECT_NEAR(record.displacement_mm, 4.0, 1e-9);
    EXPECT_NEAR(dot(record.device_command_n, outward), 2.0, 0.02);
    EXPECT_NEAR(dot(record.normal, outward), 1.0, 1e-12);
  }
  // In its middle no side is nearest: still a number.
  hal::RigSample middle = bench.at_depth(0.0, 0.0);
  middle.tip_position_mm = centre_mm;
  EXPECT_TRUE(hal::finite(bench.tick(middle).device_command_n));
}

TEST(WallPipeline, AWallThatAppearsAroundTheToolDoesNotThrowItOut) {
  SceneSpec spec = rigid(0.5);
  spec.kind = SceneKind::kWall;
  Bench bench(spec);
  EXPECT_EQ(bench.press(6.0, 6.0, 0.0, 500).device_command_n.z, 0.0);
  bench.press(6.0, -1.0, 0.0, 200);
  EXPECT_GT(bench.press(-1.0, 2.0, 0.0, 200).device_command_n.z, 0.8);
}

/// Heights of a function on a grid of 5 mm from (-30, -20) on.
template <class Height>
SurfaceMapParameters scanned(Height&& height) {
  SurfaceMapParameters map{.from_mm = {-30.0, -20.0}, .columns = 13};
  for (int row = 0; row < 9; ++row)
    for (int column = 0; column < 13; ++column)
      map.heights_mm.push_back(height(-30.0 + 5.0 * column, -20.0 + 5.0 * row));
  return map;
}

double ball_height(double x, double y) {
  return std::sqrt(50.0 * 50.0 - x * x - y * y) - 50.0;
}

TEST(SurfaceMap, IsExactOnQuadraticsUpToItsEdges) {
  const auto height = [](double x, double y) {
    return 3.0 + 0.1 * x - 0.2 * y + 0.01 * x * x - 0.02 * x * y + 0.005 * y * y;
  };
  const SurfaceMap map(scanned(height));
  for (double x = -29.9; x < 30.0; x += 1.7) {
    for (double y = -19.9; y < 20.0; y += 1.3) {
      const SurfaceMap::Point point = map.at(x, y);
      EXPECT_NEAR(point.height_mm, height(x, y), 1e-12);
      EXPECT_NEAR(point.slope_x, 0.1 + 0.02 * x - 0.02 * y, 1e-12);
      EXPECT_NEAR(point.slope_y, -0.2 - 0.02 * x + 0.01 * y, 1e-12);
    }
  }
}

TEST(SurfaceMap, GoesOnLevelBeyondItsEdges) {
  const SurfaceMap map(scanned(ball_height));
  EXPECT_EQ(map.at(100.0, 0.0).height_mm, map.at(30.0, 0.0).height_mm);
  EXPECT_EQ(map.at(100.0, 0.0).slope_x, 0.0);
  EXPECT_EQ(map.at(0.0, -1e9).height_mm, map.at(0.0, -20.0).height_mm);
}

TEST(SurfaceMap, HeightAndSlopeAreContinuousAcrossCells) {
  const SurfaceMap map(scanned([](double x, double y) { return std::sin(0.3 * x) * std::cos(0.2 * y); }));
  constexpr double kStep = 1e-7;
  for (double x = -25.0; x < 26.0; x += 5.0) {
    const SurfaceMap::Point before = map.at(x - kStep, 3.0);
    const SurfaceMap::Point after = map.at(x + kStep, 3.0);
    EXPECT_NEAR(before.height_mm, after.height_mm, 1e-6);
    EXPECT_NEAR(before.slope_x, after.slope_x, 1e-6);
    EXPECT_NEAR(before.slope_y, after.slope_y, 1e-6);
  }
}

TEST(WallSurface, AScannedBallIsTheBall) {
  const BallParameters ball{{0.0, 0.0, -50.0}, 50.0};
  const WallSurface smooth({0.0, 0.0, -1.0}, 0.0, ball, std::nullopt);
  const WallSurface map({0.0, 0.0, -1.0}, 0.0, std::nullopt, scanned(ball_height));
  for (double x = -24.0; x <= 24.0; x += 3.0) {
    for (const double depth : {0.0, 1.0, 4.0}) {
      const double y = 0.3 * x;
      const hal::Vector3 tip_mm{x, y, ball_height(x, y) - depth};
      const auto by_ball = smooth.at(tip_mm);
      const auto by_map = map.at(tip_mm);
      // The tangent plane's error: depth² slope²/(2 R), at most 0.04 mm here, and what 5 mm between heights
      // leave.
      EXPECT_NEAR(by_map.depth_mm, by_ball.depth_mm, 0.06) << x << ", " << depth;
      EXPECT_GT(dot(by_map.inward, by_ball.inward), 0.999);
    }
  }
}

TEST(WallPipeline, AScannedSurfacePushesAlongItsNormal) {
  SceneSpec spec = rigid(0.5);
  spec.kind = SceneKind::kWall;
  spec.wall_map = scanned([](double x, double) { return 0.5 * x; });
  Bench bench(spec);
  const auto at = [&bench](double depth_mm) {
    hal::RigSample sample = bench.at_depth(0.0, 0.0);
    const double cosine = 1.0 / std::sqrt(1.25);
    sample.tip_position_mm = {10.0 + 0.5 * cosine * depth_mm, 0.0, 5.0 - cosine * depth_mm};
    return sample;
  };
  for (int i = 0; i < 500; ++i) bench.tick(at(-3.0));
  TickRecord record;
  for (int i = 0; i < 1000; ++i) record = bench.tick(at(-3.0 + 0.007 * i));
  for (int i = 0; i < 500; ++i) record = bench.tick(at(4.0));
  EXPECT_NEAR(record.displacement_mm, 4.0, 1e-9);
  const double cosine = 1.0 / std::sqrt(1.25);
  EXPECT_NEAR(record.device_command_n.x, -0.5 * cosine * 2.0, 0.02);
  EXPECT_NEAR(record.device_command_n.z, cosine * 2.0, 0.02);
}

/// A virtual object of an identified law, on a device that is stiff and on one that bends.
TEST(WallPipeline, FollowsAnIdentifiedLaw) {
  for (const double structure : {0.0, 2.5}) {
    for (const double exponent : {1.0, 1.7, 3.0}) {
      SceneSpec spec = rigid(0.0);
      spec.kind = SceneKind::kWall;
      spec.target.kind = TargetLaw::Kind::kHuntCrossley;
      const double stiffness = 0.7 / std::pow(20.0, exponent - 1.0) / exponent;
      spec.target.hunt_crossley = {stiffness, 0.0, exponent};
      spec.structural_compensation = structure > 0.0;
      spec.structural_stiffness_n_per_mm = structure;
      Bench bench(spec);
      bench.press(-5.0, -0.1, 0.0, 500);
      bench.press(-0.1, 7.0, 0.0, 2000);
      const TickRecord record = bench.press(7.0, 7.0, 0.0, 1000);
      const double force_n = record.device_command_n.z;
      const double tip_mm = 7.0 + (structure > 0.0 ? force_n / structure : 0.0);
      EXPECT_NEAR(force_n, stiffness * std::pow(tip_mm, exponent), 0.01 * force_n + 1e-3)
          << exponent << ", structure " << structure;
      EXPECT_NEAR(record.displacement_mm, tip_mm, 0.01 * tip_mm);
    }
  }
}

TEST(WallPipeline, DampingHoldsBackOnTheWayInAndNeverPulls) {
  SceneSpec spec = rigid(0.0);
  spec.kind = SceneKind::kWall;
  spec.target.kind = TargetLaw::Kind::kHuntCrossley;
  spec.target.hunt_crossley = {0.05, 0.002, 1.5};
  Bench bench(spec);
  bench.press(-5.0, 0.0, 0.0, 500);
  const TickRecord in = bench.press(0.0, 5.0, 0.0, 20);  // 250 mm/s
  const TickRecord rest = bench.press(5.0, 5.0, 0.0, 300);
  const TickRecord out = bench.press(5.0, 4.0, 0.0, 5);
  EXPECT_GT(in.desired_force_n * -1.0, 1.5 * -rest.desired_force_n);
  EXPECT_GE(-out.desired_force_n, 0.0);
  EXPECT_NEAR(-rest.desired_force_n, 0.05 * std::pow(5.0, 1.5), 0.01);
}

TEST(WallPipeline, ASampleThatIsNoNumberLeavesNothingBehind) {
  SceneSpec spec = rigid(0.0);
  spec.kind = SceneKind::kWall;
  spec.target.kind = TargetLaw::Kind::kHuntCrossley;
  spec.target.hunt_crossley = {0.05, 0.002, 1.5};
  spec.guard.resume_ramp_s = 0.0;
  Bench bench(spec);
  bench.press(-5.0, 5.0, 0.0, 1000);
  hal::RigSample none = bench.at_depth(5.0, 0.0);
  none.tip_position_mm.z = std::nan("");
  EXPECT_TRUE(hal::finite(bench.tick(none).device_command_n));
  bench.press(5.0, 5.0, 0.0, 10);
  ASSERT_TRUE(bench.renderer().clear());
  bench.press(-5.0, -5.0, 0.0, 300);
  bench.press(-5.0, 5.0, 0.0, 1000);
  const TickRecord record = bench.press(5.0, 5.0, 0.0, 500);
  EXPECT_NEAR(record.device_command_n.z, 0.05 * std::pow(5.0, 1.5), 0.01);
}

TEST(WallScene, RefusesASurfaceThatIsNone) {
  const auto refused = [](auto&& change) {
    SceneSpec spec;
    spec.kind = SceneKind::kWall;
    spec.wall_map = scanned(ball_height);
    change(spec);
    hal::RigInfo info;
    info.device = {"phantom_1_0", 8.5, 1.4, 0.03, 3.5, 75.0};
    const auto resolved = resolve(spec, info);
    return resolved ? std::string() : resolved.error().what;
  };
  EXPECT_EQ(refused([](SceneSpec&) {}), "");
  EXPECT_NE(refused([](SceneSpec& s) { s.wall_map->heights_mm.pop_back(); }), "");
  EXPECT_NE(refused([](SceneSpec& s) { s.wall_map->columns = 0; }), "");
  EXPECT_NE(refused([](SceneSpec& s) { s.wall_map->heights_mm[20] = NAN; }), "");
  EXPECT_NE(refused([](SceneSpec& s) { s.wall_map->heights_mm[20] += 40.0; }), "");
  EXPECT_NE(refused([](SceneSpec& s) { s.wall_map->step_mm = 0.0; }), "");
  EXPECT_NE(refused([](SceneSpec& s) { s.wall_ball.emplace(); }), "");
  EXPECT_NE(refused([](SceneSpec& s) { s.press_axis = {1.0, 0.0, 0.0}; }), "");
}

}  // namespace
}  // namespace hapticd::rt
