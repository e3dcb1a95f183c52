// What is added so that the hand gets the force while it moves, block by block and in the scene of one
// dimension. ReactionLead has a separate file.

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <string>

#include "rt/control/back_drive_compensation.h"
#include "rt/control/default_gains.h"
#include "rt/control/loop_delay.h"
#include "tests/unit/rt/scene/pipeline_bench.h"

namespace hapticd::rt {
namespace {

constexpr double kFrictionN = 0.2;
constexpr double kObjectNPerMm = 0.8;
constexpr double kTargetNPerMm = 0.5;
constexpr double kStructureNPerMm = 3.5;

TEST(LoopDelay, FollowsFromGainsAndRate) {
  const ControllerParameters small = default_gains("phantom_1_0");
  const ControllerParameters large = default_gains("phantom_1_5_high_force");
  EXPECT_NEAR(reaction_delay_s(small, 1000.0), 3.7e-3, 0.05e-3);
  EXPECT_NEAR(reaction_delay_s(large, 1000.0), 2.45e-3, 0.05e-3);
  EXPECT_LT(reaction_delay_s(small, 5000.0), reaction_delay_s(small, 1000.0));
  ControllerParameters open = small;
  open.law = ControlLaw::kOpenLoop;
  EXPECT_NEAR(reaction_delay_s(open, 1000.0), 1e-3 + kActuationDelayS, 1e-12);
  EXPECT_GE(reaction_delay_s({ControlLaw::kClosedLoop, 0.0, 0.0}, 1000.0), 0.0) << "gains not yet resolved";
}

TEST(BackDriveCompensation, HoldsAtRestAndIsLessThanTheFriction) {
  BackDriveCompensation compensation(kFrictionN);
  EXPECT_EQ(compensation.update(0.0), 0.0) << "before any motion its sign is not known";
  for (int i = 0; i < 100; ++i) compensation.update(0.03);
  const double pushed_n = compensation.update(0.03);
  EXPECT_NEAR(pushed_n, BackDriveCompensation::kShare * kFrictionN, 1e-6);
  EXPECT_LT(pushed_n, kFrictionN);
  EXPECT_EQ(compensation.update(0.0), pushed_n);
  for (int i = 0; i < 100; ++i) compensation.update(-0.03);
  EXPECT_NEAR(compensation.update(-0.03), -pushed_n, 1e-6);
  compensation.update(std::numeric_limits<double>::quiet_NaN());
  compensation.reset();
  EXPECT_EQ(compensation.update(0.0), 0.0);
}

TEST(BackDriveCompensation, IsTheSameAlongALineAsInSpace) {
  BackDriveCompensation line(kFrictionN);
  BackDriveCompensation3 space(kFrictionN);
  for (int i = 0; i < 50; ++i) {
    const double step_mm = 0.04 * std::sin(0.4 * i);
    EXPECT_NEAR(space.update({0.0, 0.0, step_mm}).z, line.update(step_mm), 1e-12);
  }
  EXPECT_FALSE(BackDriveCompensation(0.0).is_on());
}

/// `tap_1d` with compensation on a device with friction, pressed onto an ideal spring.
class Tapped {
 public:
  explicit Tapped(const CompensationParameters& compensation, double max_force_n = 8.5, bool bends = false)
      : bench_(scene(compensation, max_force_n, bends),
               {"phantom_1_0", 8.5, 1.4, 0.03, kStructureNPerMm, 75.0, kFrictionN}) {}

  /// One tick, `ms` after the last.
  TickRecord at(double depth_mm, int ms = 1) {
    bench_.pass_ms(ms - 1);
    return bench_.tick(bench_.at_depth(depth_mm, kObjectNPerMm));
  }
  /// Evenly from one depth to another.
  TickRecord press(double from_mm, double to_mm, int ticks) {
    return bench_.press(from_mm, to_mm, kObjectNPerMm, ticks);
  }

 private:
  static SceneSpec scene(const CompensationParameters& compensation, double max_force_n, bool bends) {
    SceneSpec spec = rigid(kTargetNPerMm);
    spec.structural_compensation = bends;
    spec.compensation = compensation;
    spec.guard.max_force_n = max_force_n;
    spec.tool_mass_g = 0.0;  // samples are made without inertia
    return spec;
  }

  Bench bench_;
};

constexpr CompensationParameters kNone{.lead_ms = 0.0, .reaction_lead_share = 0.0, .back_drive = false};
constexpr double kSpeedMmPerS = 40.0;

/// Pressing at 40 mm/s, 4 mm deep.
TickRecord pressing_on(const CompensationParameters& compensation) {
  Tapped scene(compensation);
  scene.press(-2.0, -2.0, 200);
  return scene.press(-2.0, 4.0, 150);
}

TEST(TapCompensation, WithoutAnyTheForceIsThatOfThePresentTick) {
  EXPECT_NEAR(pressing_on(kNone).desired_force_n, (kObjectNPerMm - kTargetNPerMm) * 4.0, 0.02);
}

TEST(TapCompensation, ReactionAndDisplacementArePredictedByTheSame) {
  CompensationParameters lead = kNone;
  lead.reaction_lead_share = 0.9;
  const double ahead_n = pressing_on(lead).desired_force_n - pressing_on(kNone).desired_force_n;
  const double delay_s = reaction_delay_s(default_gains("phantom_1_0"), 1000.0);
  EXPECT_NEAR(ahead_n, 0.9 * delay_s * (kObjectNPerMm - kTargetNPerMm) * kSpeedMmPerS, 0.01);
}

TEST(TapCompensation, WhatTheDevicesFrictionNoLongerBendsIsNoDisplacement) {
  CompensationParameters back_drive = kNone;
  back_drive.back_drive = true;
  const auto displacement_mm = [](const CompensationParameters& compensation) {
    Tapped scene(compensation, 8.5, true);
    scene.press(-2.0, -2.0, 200);
    return scene.press(-2.0, 4.0, 150).displacement_mm;
  };
  // The approaching hand drags the motors by 0.2 N through the structure, in contact by a fifth of it: the
  // encoders go on by what that bent, the tip does not.
  const double unbent_mm = BackDriveCompensation::kShare * kFrictionN / kStructureNPerMm;
  EXPECT_NEAR(displacement_mm(kNone) - displacement_mm(back_drive),
              unbent_mm / (1.0 - kTargetNPerMm / kStructureNPerMm), 1e-3);
}

TEST(TapCompensation, TheDevicesFrictionIsAddedBehindTheController) {
  CompensationParameters back_drive = kNone;
  back_drive.back_drive = true;
  const TickRecord with = pressing_on(back_drive);
  const TickRecord without = pressing_on(kNone);
  EXPECT_NEAR(with.desired_force_n, without.desired_force_n, 1e-9);
  EXPECT_NEAR(with.commanded_force_n - without.commanded_force_n, BackDriveCompensation::kShare * kFrictionN,
              0.005);
  EXPECT_NEAR(with.hand_force_n, without.hand_force_n, 1e-6) << "what it moves is the arm, not the hand";
}

TEST(TapCompensation, NothingIsAddedInFreeAir) {
  Tapped scene({});
  for (int i = 0; i < 2000; ++i) {
    const TickRecord record = scene.at(-10.0 + 5.0 * std::sin(0.02 * i));
    ASSERT_EQ(record.commanded_force_n, 0.0) << "tick " << i;
  }
}

TEST(TapCompensation, ALateTickIsNoJump) {
  Tapped scene({});
  scene.press(-2.0, -2.0, 200);
  const TickRecord before = scene.press(-2.0, 4.0, 150);
  const TickRecord after = scene.at(4.0 + 5e-3 * kSpeedMmPerS, 5);
  const double expected_n = (kObjectNPerMm - kTargetNPerMm) * 5e-3 * kSpeedMmPerS;
  EXPECT_NEAR(after.desired_force_n - before.desired_force_n, expected_n, 0.05);
}

TEST(TapCompensation, AtTheGuardsLimitNothingWindsUp) {
  Tapped scene({}, 0.5);
  scene.press(-2.0, -2.0, 200);
  scene.press(-2.0, 8.0, 250);
  const TickRecord full = scene.press(8.0, 8.0, 1000);
  EXPECT_NEAR(std::abs(full.device_command_n.z), 0.5, 1e-9);
  EXPECT_LT(std::abs(full.commanded_force_n), 0.5 + (kObjectNPerMm - kTargetNPerMm) * 8.0 + kFrictionN);
  scene.press(8.0, 0.8, 180);
  const TickRecord released = scene.press(0.8, 0.8, 200);
  EXPECT_LT(std::abs(released.device_command_n.z), 0.45);
}

TEST(CompensationScene, WhatIsOffIsNoStage) {
  SceneSpec spec;
  spec.compensation.reaction_lead_share = 0.9;  // as resolved
  const auto mentions = [&spec](const char* word) {
    for (const std::string& stage : outline(spec).stages) {
      if (stage.find(word) != std::string::npos) return true;
    }
    return false;
  };
  EXPECT_TRUE(mentions("prediction: reaction"));
  EXPECT_FALSE(mentions("prediction: displacement")) << "only while exploring";
  EXPECT_TRUE(mentions("back-drive"));
  spec.compensation = kNone;
  EXPECT_FALSE(mentions("prediction"));
  EXPECT_FALSE(mentions("back-drive"));
}

}  // namespace
}  // namespace hapticd::rt
