// Programs and objects that change while the world goes on.

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <string>
#include <thread>

#include "hal/sim/object/shape.h"
#include "virtual_rig.h"

namespace hapticd::sim {
namespace {

using test::VirtualRig;

HandProgram pressing(double force_n) {
  return {.kind = HandProgram::Kind::kPress, .force_n = force_n, .force_rate_n_per_s = 4.0, .hold_s = -1.0};
}

TEST(ChangingObject, APressingHandLiftsOffFirstAndPressesAgain) {
  for (const auto& [before, after] :
       {std::array{"sponge_block", "rubber_eraser"}, std::array{"rubber_eraser", "sponge_block"},
        std::array{"foam_ball", "wood_plate"}}) {
    VirtualRig rig({.object = before}, pressing(3.0));
    rig.run(6.0);
    ASSERT_GT(rig.truth().normal_force_n, 2.5);
    rig.set_object(after);
    EXPECT_EQ(rig.rig().object(), after);
    bool lifted = false;
    double last_n = rig.truth().normal_force_n, max_n = 0.0;
    rig.run(8.0, [&] {
      const double normal_n = rig.truth().normal_force_n;
      if (!rig.truth().in_contact) lifted = true;
      ASSERT_LT(normal_n, lifted ? 1.15 * 3.0 : last_n + 0.1) << "only ever less until the tip is clear";
      ASSERT_LT(std::abs(normal_n - last_n), 1.0) << "no jolt";
      last_n = normal_n;
      max_n = std::max(max_n, normal_n);
    });
    EXPECT_TRUE(lifted);
    EXPECT_LT(max_n, 1.15 * 3.0);
    EXPECT_NEAR(rig.truth().normal_force_n, 3.0, 0.15) << "the program goes on with the new object";
    const double stiffness = object_preset(after)->material.stiffness_at_4n_n_per_mm;
    EXPECT_LT(rig.truth().displacement_mm, 3.0 / stiffness * 1.5);
    EXPECT_GT(rig.truth().displacement_mm, 3.0 / stiffness * 0.6);
  }
}

TEST(ChangingObject, AnObjectIsNotPutAroundTheTip) {
  // With the table empty a pressing hand has gone deep below where an object would be.
  for (const std::string& object : object_preset_names()) {
    VirtualRig rig({.object = "none"}, pressing(2.0));
    rig.run(8.0);
    ASSERT_LT(rig.truth().tip_position_mm.z, -20.0);
    rig.set_object(object.c_str());
    double max_n = 0.0;
    rig.run(10.0, [&] { max_n = std::max(max_n, rig.truth().normal_force_n); });
    EXPECT_LT(max_n, 2.5) << object;
    EXPECT_NEAR(rig.truth().reaction_force_n.z, 2.0, 0.2) << object;
  }
}

TEST(ChangingObject, AHandBesideABallIsNotInsideThePlate) {
  // Lifted off the flank of the ball, the tip is free, yet below the plate that is to come.
  VirtualRig rig({.object = "rubber_ball"}, {.kind = HandProgram::Kind::kStroke,
                                             .force_n = 1.0,
                                             .speed_mm_per_s = 100.0,
                                             .repetitions = 1,
                                             .stroke_length_mm = 120.0});
  double lowest_mm = 0.0;
  for (; rig.time_s() < 15.0 && lowest_mm > -8.0;) {
    rig.tick();
    if (!rig.truth().in_contact) lowest_mm = std::min(lowest_mm, rig.truth().tip_position_mm.z);
  }
  ASSERT_LT(lowest_mm, -5.0) << "the hand got next to the ball";
  rig.set_object("rubber_eraser");
  double max_n = 0.0;
  rig.run(1.5, [&] { max_n = std::max(max_n, rig.truth().normal_force_n); });
  EXPECT_LT(max_n, 5.0);
}

TEST(ChangingObject, AWeightIsLiftedOffAndLetDownAgain) {
  VirtualRig rig({.object = "rubber_eraser"}, {.kind = HandProgram::Kind::kWeight});
  rig.run(15.0);
  ASSERT_GT(rig.truth().normal_force_n, 3.9);
  rig.set_object("sponge_block");
  bool lifted = false;
  rig.run(25.0, [&] { lifted = lifted || !rig.truth().in_contact; });
  EXPECT_TRUE(lifted);
  EXPECT_NEAR(rig.truth().normal_force_n, 0.408 * 9.807, 0.065);
  EXPECT_GT(rig.truth().displacement_mm, 5.0) << "on the sponge";
}

TEST(ChangingObject, AWeightWithNothingUnderItHangsOnItsCord) {
  VirtualRig rig({.object = "none"}, {.kind = HandProgram::Kind::kWeight});
  double lowest_mm = 0.0;
  rig.run(30.0, [&] { lowest_mm = std::min(lowest_mm, rig.truth().tip_position_mm.z); });
  EXPECT_LT(lowest_mm, -40.0) << "it fell";
  EXPECT_NEAR(rig.truth().tip_position_mm.z, -44.0, 2.0) << "4 N on 1 N/mm, and dry friction";
}

TEST(ChangingObject, AwayFromTheObjectItIsThereAtTheNextRead) {
  VirtualRig rig({.object = "none"});
  rig.run(0.5);
  rig.set_object("sponge_block");
  rig.tick();
  EXPECT_EQ(rig.truth().outward_normal.z, 1.0);
  EXPECT_NEAR(rig.truth().undeformed_contact_mm.x, rig.truth().tip_position_mm.x, 1e-6);
}

TEST(ChangingObject, TheLastWordBeforeAReadCounts) {
  VirtualRig rig({.object = "none"}, pressing(2.0));
  rig.set_object("sponge_block");
  rig.set_object("wood_plate");
  rig.set_program(pressing(1.0));
  rig.run(5.0);
  EXPECT_NEAR(rig.truth().normal_force_n, 1.0, 0.1);
  EXPECT_LT(rig.truth().displacement_mm, 0.1) << "wood, not sponge";
}

TEST(ChangingProgram, TheHandGoesOnFromWhereItIs) {
  // From every program into rest, in mid-motion: no jump of the intended position, so no blow on the tip.
  for (const double when_s : {2.0, 4.05, 4.6, 5.2}) {
    VirtualRig rig({.object = "wood_plate"}, {.kind = HandProgram::Kind::kStroke,
                                              .force_n = 2.0,
                                              .force_rate_n_per_s = 4.0,
                                              .speed_mm_per_s = 100.0,
                                              .repetitions = -1,
                                              .stroke_length_mm = 100.0});
    rig.run(when_s);
    rig.set_program(HandProgram{});
    hal::Vector3 last_n = rig.truth().hand_force_n;
    double jolt_n = 0.0;
    rig.run(2.0, [&] {
      jolt_n = std::max(jolt_n, test::length(rig.truth().hand_force_n - last_n));
      last_n = rig.truth().hand_force_n;
    });
    EXPECT_LT(jolt_n, 2.5) << when_s << " s: no more in a tick than the press itself";
    EXPECT_NEAR(rig.truth().tip_position_mm.z, 10.0, 0.3);
  }
}

TEST(ChangingProgram, AnotherThreadMayDoItWhileTheClockRuns) {
  VirtualRig rig({.object = "sponge_block"});
  std::atomic<bool> over{false};
  std::thread other([&] {
    const auto objects = object_preset_names();
    for (std::size_t i = 0; !over.load(); ++i) {
      const auto kind = i % 3 == 0   ? HandProgram::Kind::kPress
                        : i % 3 == 1 ? HandProgram::Kind::kTap
                                     : HandProgram::Kind::kRest;
      EXPECT_FALSE(rig.rig().set_program({.kind = kind, .repetitions = -1}));
      EXPECT_FALSE(rig.rig().set_object(objects[i % objects.size()]));
      EXPECT_EQ(rig.rig().object(), objects[i % objects.size()]);
      EXPECT_TRUE(rig.rig().set_object("anvil"));
      std::this_thread::yield();
    }
  });
  double max_n = 0.0;
  bool sane = true;
  rig.run(20.0, [&] {
    max_n = std::max(max_n, rig.truth().normal_force_n);
    sane = sane && finite(rig.truth().tip_position_mm) && finite(rig.sample().sensor_force_n);
  });
  over = true;
  other.join();
  EXPECT_TRUE(sane);
  EXPECT_LT(max_n, 200.0) << "a hard tap on wood at most";
}

}  // namespace
}  // namespace hapticd::sim
