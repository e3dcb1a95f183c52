#include "rt/contact/contact_stage.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

namespace hapticd::rt {
namespace {

constexpr double kStageToolG = 9.35;

/// A tool moved along a line, with whatever force its sensor reads, through the stage as a scene uses it.
class Line {
 public:
  explicit Line(double rate_hz = 1000.0)
      : period_s_(1.0 / rate_hz), timer_(rate_hz), stage_({}, kStageToolG, rate_hz) {}

  /// One tick `late_s` after it was due.
  void tick(double depth_mm, double force_n, double acceleration_mm_per_s2 = 0.0, double late_s = 0.0) {
    time_s_ += period_s_ + late_s;
    const double velocity_mm_per_s = (depth_mm - depth_before_mm_) / (period_s_ + late_s);
    depth_before_mm_ = depth_mm;
    const auto now_ns = static_cast<std::int64_t>(std::llround(1e9 * time_s_));
    ContactStage::Input input;
    input.interval = timer_.update(now_ns);
    input.free_motion = {force_n, depth_mm, now_ns,
                         now_ns - static_cast<std::int64_t>(0.5e9 * (period_s_ + late_s))};
    input.tip_mm = input.depth_mm = depth_mm;
    input.velocity_mm_per_s = velocity_mm_per_s;
    input.reaction_n = std::abs(force_n);
    input.contact_depth_mm = contact_depth_mm_;
    input.acceleration_mm_per_s2 = std::abs(acceleration_mm_per_s2);
    stage_.detect(input);
    if (stage_.detector().just_declared()) contact_depth_mm_ = stage_.onset_mm();
    if (!stage_.in_contact()) return;
    const double x = depth_mm - contact_depth_mm_;
    stage_.judge({force_n, x, x, std::abs(acceleration_mm_per_s2)}, input.interval);
  }
  /// A hand's wave for a while, with a constant error of the sensor's.
  void wave(double seconds, double error_n, double late_s = 0.0) {
    const double omega = 2.0 * std::numbers::pi * 2.2;
    for (int i = 0; i * period_s_ < seconds; ++i) {
      const double step_s = period_s_ + (i % 500 == 250 ? late_s : 0.0);
      const double t = time_s_ + step_s;
      const double depth_mm = 20.0 * std::sin(omega * t);
      const double mean_acceleration =
          20.0 * omega * (std::cos(omega * t) - std::cos(omega * time_s_)) / step_s;  // over the tick
      tick(depth_mm, 1e-6 * kStageToolG * mean_acceleration + error_n, -omega * omega * depth_mm,
           step_s - period_s_);
      largest_ = std::max(largest_, stage_.authority());
    }
  }
  /// The guard does not know the zero.
  void distrust() { stage_.distrust(); }
  const ContactDetector& detector() const { return stage_.detector(); }
  const ContactStage& stage() const { return stage_; }
  double largest_authority() const { return largest_; }
  double contact_depth_mm() const { return contact_depth_mm_; }

 private:
  double period_s_;
  TickTimer timer_;
  ContactStage stage_;
  double time_s_ = 0.0;
  double contact_depth_mm_ = 0.0;
  double depth_before_mm_ = 0.0;
  double largest_ = 0.0;
};

TEST(ContactStage, LateTicksOfAFreeToolAreNoContact) {
  for (const double rate_hz : {1000.0, 5000.0}) {
    for (const double late_s : {0.0003, 0.0017, 0.005, 0.015, 0.017, 0.05, 0.2}) {
      Line line(rate_hz);
      line.wave(3.0, 0.0, late_s);
      EXPECT_EQ(line.detector().count(), 0U) << rate_hz << " Hz, " << late_s << " s";
      EXPECT_TRUE(line.detector().is_free());
    }
  }
}

TEST(ContactStage, AStopIsNoContactAndTheOneThatFollowsIsSeen) {
  // A hand that stops within 2 ms, faster than the filters follow: the tool's inertia pushes the way it went.
  Line line;
  double depth_mm = 0.0;
  for (int i = 0; i < 300; ++i) line.tick(depth_mm += 0.06, 0.0);
  const double stop_n = 1e-6 * kStageToolG * -60.0 / 0.002;
  ASSERT_LT(stop_n, -0.2);
  line.tick(depth_mm += 0.045, stop_n, -30e3);
  line.tick(depth_mm += 0.015, stop_n, -30e3);
  for (int i = 0; i < 3; ++i) line.tick(depth_mm += 0.011, -0.1);
  EXPECT_EQ(line.detector().count(), 0U);
  for (int i = 0; i < 100; ++i) line.tick(depth_mm, 0.0);
  EXPECT_EQ(line.detector().withdrawn_count(), 0U);
  for (int i = 0; i < 200; ++i) line.tick(depth_mm + 0.02 * i, 0.4 * 0.02 * i);
  EXPECT_TRUE(line.stage().in_contact());
  EXPECT_EQ(line.stage().authority(), 1.0);
}

TEST(ContactStage, WhatPushesTheTipTheWayItGoesIsAnObjectOnceItIsUnmistakable) {
  // An object that comes after the tip.
  Line line;
  for (int i = 0; i < 100; ++i) line.tick(0.0, 0.0);
  for (int i = 0; i < 100; ++i) line.tick(-0.03 * i, 0.008 * i);
  EXPECT_EQ(line.detector().count(), 1U);
}

TEST(ContactStage, AWrongZeroIsWithdrawnAndEarnsNothing) {
  Line line;
  line.wave(1.0, 0.0);
  line.wave(5.0, 0.05);
  EXPECT_GT(line.detector().withdrawn_count(), 0U);
  EXPECT_EQ(line.largest_authority(), 0.0);
  EXPECT_TRUE(line.stage().zero_shows()) << "so that it can be followed";
}

TEST(ContactStage, WhatIsReadOnceTheTipHasDrawnBackFromAProvenContactIsTheZero) {
  for (const double left_n : {0.01, 0.03, -0.03, 0.09}) {  // within the threshold, and beyond it
    Line line;
    for (int i = 0; i < 200; ++i) line.tick(-5.0, 0.0);
    for (int i = 0; i < 300; ++i) line.tick(-5.0 + 0.03 * i, std::max(0.0, 0.4 * (-5.0 + 0.03 * i)));
    ASSERT_EQ(line.stage().authority(), 1.0);
    bool was_shown_near = false;
    for (int i = 0; i < 300; ++i) {
      const double depth_mm = 4.0 - 0.03 * i;
      line.tick(depth_mm, std::max(0.0, 0.4 * depth_mm) + left_n);
      was_shown_near = was_shown_near || (depth_mm > 0.0 && line.stage().zero_shows_in_motion());
    }
    EXPECT_FALSE(was_shown_near) << left_n << " N: it still touches";
    EXPECT_TRUE(line.stage().zero_shows_in_motion()) << left_n << " N";
    for (int i = 0; i < 1000; ++i) line.tick(-5.0, left_n);
    EXPECT_FALSE(line.stage().zero_shows_in_motion()) << left_n << " N: long ago";
  }
}

TEST(ContactStage, AfterALossInTheMiddleOfAnObjectALittleThatIsReadIsNotTheZero) {
  Line line;
  for (int i = 0; i < 200; ++i) line.tick(-5.0, 0.0);
  for (int i = 0; i < 300; ++i) line.tick(-5.0 + 0.03 * i, std::max(0.0, 0.4 * (-5.0 + 0.03 * i)));
  // It gives way under the tip, which goes on into it.
  for (int i = 0; i < 300; ++i) {
    line.tick(4.0 + 0.03 * i, 0.06);
    EXPECT_FALSE(line.stage().zero_shows_in_motion()) << i;
  }
}

TEST(ContactStage, ALoadThatComesWhileAFreeToolIsWaitedForIsReported) {
  constexpr double kWrongZeroN = 0.12;  // beyond what is taken over
  const auto press = [](Line& line, double seconds, double force_n) {
    for (int i = 0; i < static_cast<int>(1e3 * seconds); ++i) line.tick(0.0, kWrongZeroN + force_n);
  };
  Line pressed;
  press(pressed, 2.0, 1.0);
  EXPECT_FALSE(pressed.stage().waits_in_motion()) << "it may have been pressed when the scene was loaded";
  Line line;
  press(line, 0.5, 0.0);
  ASSERT_TRUE(line.detector().is_waiting());
  EXPECT_FALSE(line.stage().waits_in_motion());
  press(line, 0.5, 1.0);
  EXPECT_TRUE(line.stage().waits_in_motion());
  press(line, 0.5, 0.0);
  EXPECT_TRUE(line.stage().waits_in_motion()) << "until the tool is seen free";
  for (int i = 0; i < 500; ++i) line.tick(0.0, 0.0);
  EXPECT_TRUE(line.detector().is_free());
  EXPECT_FALSE(line.stage().waits_in_motion());
}

TEST(ContactStage, LoadsWhoseZeroIsNotTrustedAreReportedAlthoughTheToolLooksFreeAtTimes) {
  Line line;
  const auto press = [&line](double seconds, double force_n) {
    for (int i = 0; i < static_cast<int>(1e3 * seconds); ++i) {
      line.distrust();  // as under hum, with which the guard finds no zero
      line.tick(0.0, force_n);
    }
  };
  press(0.5, 0.0);
  press(0.5, 1.0);
  EXPECT_EQ(line.detector().count(), 0U);
  EXPECT_TRUE(line.stage().waits_in_motion());
}

TEST(ContactStage, WhatIsHeldOverALateTickIsHeld) {
  const auto held = [](double moved_mm, double left_share) {
    Line line;
    for (int i = 0; i < 100; ++i) line.tick(-1.0, 0.0);
    for (int i = 0; i < 300; ++i) line.tick(-1.0 + 0.01 * i, std::max(0.0, 0.4 * (-1.0 + 0.01 * i)));
    for (int i = 0; i < 500; ++i) line.tick(2.0, 0.8);
    EXPECT_EQ(line.stage().authority(), 1.0);
    line.tick(2.0 + moved_mm, 0.8 * left_share, 0.0, 0.02);
    return line.stage().authority();
  };
  EXPECT_EQ(held(0.0, 1.0), 1.0);
  EXPECT_LT(held(0.0, 0.8), 0.5) << "it may have let go";
  EXPECT_LT(held(-0.5, 1.0), 0.5) << "it may be elsewhere";
}

TEST(ContactStage, AToolThatFoundTheObjectWithinAGapWaitsUntilItIsFree) {
  Line line;
  for (int i = 0; i < 100; ++i) line.tick(0.0, 0.0);
  for (int i = 0; i < 200; ++i) line.tick(5.0, 2.0, 0.0, i == 0 ? 0.1 : 0.0);
  EXPECT_EQ(line.detector().count(), 0U) << "no one saw where it began";
  EXPECT_EQ(line.detector().reason(), ContactReason::kAwaitingFree);
  for (int i = 0; i < 200; ++i) line.tick(-5.0, 0.0);
  for (int i = 0; i < 100; ++i) line.tick(-5.0 + 0.1 * i, std::max(0.0, 0.4 * (-5.0 + 0.1 * i)));
  EXPECT_TRUE(line.stage().in_contact());
}

TEST(ContactStage, AnObjectThatVanishesEndsTheContactAndLeavesTheToolFree) {
  Line line;
  for (int i = 0; i < 100; ++i) line.tick(-1.0, 0.0);
  for (int i = 0; i < 500; ++i) line.tick(-1.0 + 0.02 * i, std::max(0.0, 0.4 * (-1.0 + 0.02 * i)));
  ASSERT_EQ(line.stage().authority(), 1.0);
  line.tick(9.0, 0.02);
  EXPECT_EQ(line.stage().authority(), 0.0);
  for (int i = 0; i < 6; ++i) line.tick(9.0 + 0.1 * i, 0.02);
  EXPECT_FALSE(line.stage().in_contact());
  EXPECT_EQ(line.detector().withdrawn_count(), 0U) << "it had been an object";
}

TEST(ContactStage, ABounceIsFollowedByTheNextContact) {
  Line line;
  for (int i = 0; i < 100; ++i) line.tick(-5.0, 0.0);
  // Falls, bounces off within 20 ms, rings, and comes to rest pressed.
  for (int i = 0; i < 50; ++i) line.tick(-5.0 + 0.1 * i, 0.0);
  for (int i = 0; i < 20; ++i) {
    const double depth_mm = 0.5 * std::sin(std::numbers::pi * i / 20.0);
    line.tick(depth_mm, 2.0 * depth_mm);
  }
  for (int i = 0; i < 30; ++i) line.tick(-0.02 * i, 0.03 * std::cos(0.6 * i));
  for (int i = 0; i < 30; ++i) line.tick(-0.6 + 0.02 * i, 0.0);
  for (int i = 0; i < 200; ++i) line.tick(0.01 * i, 0.02 * i);
  EXPECT_TRUE(line.stage().in_contact());
  EXPECT_EQ(line.stage().authority(), 1.0);
}

TEST(ContactStage, AToolThatComesDownWhileItStillRingsIsSeenWhereItLands) {
  Line line;
  for (int i = 0; i < 100; ++i) line.tick(-5.0, 0.0);
  // What is declared above the object is withdrawn; the arm rings on beyond the threshold every few ticks.
  for (int i = 0; i < 60; ++i) line.tick(-5.0 + 0.06 * i, 0.05);
  ASSERT_EQ(line.detector().reason(), ContactReason::kWithdrawn);
  for (int i = 0; i < 120; ++i) line.tick(-1.4 + 0.01 * i, 0.12 * std::sin(0.15 * i));
  ASSERT_EQ(line.detector().reason(), ContactReason::kWithdrawn) << "never quiet for 20 ms";
  for (int i = 0; i < 100; ++i) line.tick(-0.2 + 0.03 * i, std::max(0.0, 0.4 * (-0.2 + 0.03 * i)));
  EXPECT_TRUE(line.stage().in_contact());
  EXPECT_EQ(line.stage().authority(), 1.0);
  EXPECT_NEAR(line.contact_depth_mm(), 0.0, 0.3);
}

}  // namespace
}  // namespace hapticd::rt
