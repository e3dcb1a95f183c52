// Objects that end, slide, tilt, move and vanish.

#include "hal/sim/object/object_events.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <thread>

#include "tests/unit/sim/virtual_rig.h"

namespace hapticd::sim {
namespace {

using test::VirtualRig;
using Kind = ObjectEvent::Kind;

HandProgram pressed_with(double force_n) {
  return {.kind = HandProgram::Kind::kPress, .force_n = force_n, .force_rate_n_per_s = 4.0, .hold_s = -1.0};
}

TEST(ObjectEvent, AVanishedObjectIsGoneAtTheVeryTick) {
  VirtualRig rig({.object = "rubber_ball", .object_events = {{.kind = Kind::kVanish, .at_s = 6.0}}},
                 pressed_with(3.0));
  double last_n = 0.0;
  rig.run(6.0, [&] { last_n = rig.truth().normal_force_n; });
  EXPECT_NEAR(last_n, 3.0, 0.3);
  rig.run(2.0, [&] {
    ASSERT_FALSE(rig.truth().in_contact) << rig.time_s();
    ASSERT_EQ(rig.truth().normal_force_n, 0.0);
    ASSERT_EQ(rig.truth().displacement_mm, 0.0);
  });
  EXPECT_LT(rig.truth().tip_position_mm.z, -15.0) << "the hand falls through";
}

TEST(ObjectEvent, AReturningObjectWaitsUntilTheTipIsClear) {
  VirtualRig rig({.object = "rubber_ball", .object_events = {{.kind = Kind::kVanish, .at_s = 5.0}}},
                 pressed_with(2.0));
  rig.run(7.0);
  ASSERT_FALSE(rig.rig().happen({.kind = Kind::kReturn}));
  rig.run(1.0, [&] { ASSERT_FALSE(rig.truth().in_contact) << "the tip is where the object would be"; });
  rig.set_program({});  // the hand lifts off
  rig.run(4.0);
  rig.set_program(pressed_with(2.0));
  rig.run(6.0);
  EXPECT_NEAR(rig.truth().normal_force_n, 2.0, 0.2);
}

TEST(ObjectEvent, AnObjectMovedDownIsLeftByTheTip) {
  VirtualRig rig({.object = "rubber_eraser",
                  .object_events = {{.kind = Kind::kMove, .at_s = 6.0, .move_mm = {0.0, 0.0, -5.0}}}},
                 pressed_with(1.0));
  rig.run(6.0);
  const double depth_mm = rig.truth().tip_position_mm.z;
  rig.tick();
  EXPECT_FALSE(rig.truth().in_contact);
  rig.run(4.0);
  EXPECT_NEAR(rig.truth().normal_force_n, 1.0, 0.1) << "found again";
  EXPECT_NEAR(rig.truth().tip_position_mm.z, depth_mm - 5.0, 0.3) << "5 mm lower";
}

TEST(ObjectEvent, AnObjectMovedUpLiftsTheTip) {
  VirtualRig rig(
      {.object = "foam_ball",
       .object_events = {{.kind = Kind::kMove, .at_s = 6.0, .move_mm = {0.0, 0.0, 5.0}, .duration_s = 1.0}}},
      pressed_with(1.0));
  rig.run(6.0);
  const double before_mm = rig.truth().tip_position_mm.z;
  rig.run(6.0);
  EXPECT_NEAR(rig.truth().tip_position_mm.z, before_mm + 5.0, 0.5);
  EXPECT_NEAR(rig.truth().normal_force_n, 1.0, 0.1);
}

TEST(ObjectEvent, ADraggedObjectDragsTheTip) {
  VirtualRig rig(
      {.object = "rubber_eraser",
       .object_events = {{.kind = Kind::kMove, .at_s = 6.0, .move_mm = {20.0, 0.0, 0.0}, .duration_s = 1.0}}},
      pressed_with(2.0));
  rig.run(6.8);
  EXPECT_GT(rig.truth().tip_position_mm.x, 1.0);
  EXPECT_GT(rig.truth().reaction_force_n.x, 1.0) << "friction of 2 N at 0.8";
}

TEST(ObjectEvent, ATiltedObjectTurnsItsNormal) {
  VirtualRig rig({.object = "rubber_eraser",
                  .object_events = {{.kind = Kind::kTilt, .at_s = 5.0, .tilt_deg = 10.0, .duration_s = 0.5}}},
                 pressed_with(1.0));
  rig.run(5.0);
  EXPECT_EQ(rig.truth().outward_normal.z, 1.0);
  rig.run(1.0);
  EXPECT_NEAR(rig.truth().outward_normal.x, std::sin(10.0 * 3.14159265 / 180.0), 1e-6);
  EXPECT_TRUE(rig.truth().in_contact);
}

TEST(ObjectEvent, WhatCannotHappenIsRefused) {
  VirtualRig rig({});
  EXPECT_TRUE(rig.rig().happen({.kind = Kind::kMove, .move_mm = {0.0, 0.0, 1e4}}));
  EXPECT_TRUE(rig.rig().happen({.kind = Kind::kTilt, .tilt_deg = 80.0}));
  EXPECT_TRUE(rig.rig().happen({.kind = Kind::kTilt, .tilt_deg = std::nan("")}));
  int taken = 0;
  while (!rig.rig().happen({.kind = Kind::kVanish}) && taken < 1000) ++taken;
  EXPECT_EQ(taken, 32) << "a full queue is reported, not overwritten";
  rig.tick();
  EXPECT_FALSE(rig.rig().happen({.kind = Kind::kVanish}));
  SimulationConfig many;
  many.object_events.resize(65);
  EXPECT_THROW(VirtualRig{many}, std::invalid_argument);
}

TEST(ObjectEdge, BeyondItThereIsNothing) {
  SimulationConfig config{.object = "rubber_eraser"};
  config.hold.edge_mm = 10.0;
  VirtualRig rig(config, {.kind = HandProgram::Kind::kStroke,
                          .force_n = 1.0,
                          .speed_mm_per_s = 60.0,
                          .repetitions = -1,
                          .stroke_length_mm = 60.0});
  bool touched = false, fell = false;
  rig.run(10.0, [&] {
    const double x = rig.truth().tip_position_mm.x;
    if (rig.truth().in_contact) {
      touched = true;
      ASSERT_LE(x, 10.1);
    }
    fell = fell || (touched && x > 10.5 && rig.truth().tip_position_mm.z < -1.0);
    ASSERT_TRUE(finite(rig.truth().tip_position_mm));
  });
  EXPECT_TRUE(touched);
  EXPECT_TRUE(fell);
}

TEST(ObjectEdge, AHandThatStrokesBeyondItStaysThere) {
  SimulationConfig config{.device = "phantom_1_5_high_force", .object = "foam_ball_3d"};
  config.hold.edge_mm = 60.0;
  HandProgram stroke{.kind = HandProgram::Kind::kStroke, .speed_mm_per_s = 80.0, .repetitions = 3};
  stroke.stroke_length_mm = 20.0;
  stroke.place_mm.x = 140.0;
  VirtualRig rig(config, stroke);
  rig.run(3.0);
  double deepest_mm = 0.0;
  for (int i = 0; i < 8000; ++i) {  // on a virtual plane, which the device renders there
    const hal::Vector3& tip_mm = rig.truth().tip_position_mm;
    ASSERT_NEAR(tip_mm.x, 140.0, 25.0) << rig.time_s();
    deepest_mm = std::max(deepest_mm, -tip_mm.z);
    rig.tick({0.0, 0.0, std::max(0.0, -0.5 * tip_mm.z)});
  }
  EXPECT_GT(deepest_mm, 1.0);
}

TEST(ObjectEdge, StiffnessFallsSmoothlyToNothing) {
  const ObjectPose pose({.edge_mm = 10.0, .edge_round_mm = 2.0}, 1e-4);
  EXPECT_TRUE(pose.displaced());
  EXPECT_EQ(pose.share_at({7.9, 0.0, 0.0}), 1.0);
  EXPECT_NEAR(pose.share_at({9.0, 0.0, 0.0}), 0.5, 1e-12);
  EXPECT_EQ(pose.share_at({10.0, 0.0, 0.0}), 0.0);
  double last = 1.0;
  for (double x = 7.0; x < 11.0; x += 0.01) {
    const double share = pose.share_at({x, 0.0, 0.0});
    EXPECT_LE(share, last);
    EXPECT_LT(last - share, 0.01);
    last = share;
  }
}

TEST(LooseObject, SlidesWithTheStrokeInsteadOfResisting) {
  const auto friction_n = [](double slides_above_n) {
    SimulationConfig config{.object = "rubber_eraser"};
    config.hold.slides_above_n = slides_above_n;
    VirtualRig rig(config, {.kind = HandProgram::Kind::kStroke,
                            .force_n = 2.0,
                            .speed_mm_per_s = 50.0,
                            .repetitions = -1,
                            .stroke_length_mm = 40.0});
    double max_n = 0.0;
    rig.run(10.0, [&] { max_n = std::max(max_n, std::abs(rig.truth().reaction_force_n.x)); });
    return max_n;
  };
  const double held_n = friction_n(0.0);
  EXPECT_GT(held_n, 1.4);
  EXPECT_LT(friction_n(0.4), 0.85 * held_n);
  EXPECT_LT(friction_n(0.1), 0.7 * held_n);
}

TEST(ObjectPose, FramesAreInverse) {
  ObjectPose pose({}, 1e-4);
  EXPECT_FALSE(pose.displaced());
  pose.begin({.kind = Kind::kMove, .move_mm = {3.0, -2.0, 1.0}});
  pose.begin({.kind = Kind::kTilt, .tilt_deg = 17.0});
  const hal::Vector3 p{4.0, 5.0, -6.0};
  EXPECT_LT(test::length(pose.to_rig(pose.to_object(p)) - p), 1e-12);
  EXPECT_NEAR(test::length(pose.direction_to_rig({0.0, 0.0, 1.0})), 1.0, 1e-12);
}

}  // namespace
}  // namespace hapticd::sim
