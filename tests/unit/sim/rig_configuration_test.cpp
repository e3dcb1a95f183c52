// What the rig refuses, and in which words.

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <string>

#include "hal/sim/simulated_rig.h"
#include "virtual_rig.h"

namespace hapticd::sim {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kInfinity = std::numeric_limits<double>::infinity();

hal::Error refusal(const SimulationConfig& config) {
  const auto rig = SimulatedRig::create(config);
  return rig ? hal::Error{.what = "accepted", .where = "", .value = "", .limit = "", .remedy = ""}
             : rig.error();
}

void expect_error(const hal::Error& error, const std::string& what, const std::string& where,
                  const std::string& value, const std::string& limit) {
  EXPECT_EQ(error.what, what);
  EXPECT_EQ(error.where, where);
  EXPECT_EQ(error.value, value);
  EXPECT_EQ(error.limit, limit);
  EXPECT_EQ(error.remedy, "");
}

TEST(RigConfiguration, UnknownDeviceIsNamedBesideTheKnown) {
  expect_error(refusal({.device = "phantom_2_0"}), "unknown device", "[rig.sim] device", "phantom_2_0",
               "phantom_1_0, phantom_1_5_high_force");
}

const std::string kObjects =
    "sponge_block, foam_ball, rubber_ball, rubber_eraser, sponge_cut, foam_ball_3d, rubber_ball_3d, "
    "silicone_rest, wood_plate, sticky_gel, foam_ridge, phantom, phantom_hard, phantom_soft, none";

TEST(RigConfiguration, UnknownObjectIsNamedBesideTheKnown) {
  expect_error(refusal({.object = "anvil"}), "unknown object", "simulated rig", "anvil", kObjects);
}

TEST(RigConfiguration, UnknownTipIsNamedBesideTheKnown) {
  expect_error(refusal({.tip = "needle"}), "unknown tip", "[rig.sim] tip", "needle", "rod, ball_bearing");
  EXPECT_EQ(refusal({.tip = "rod"}).what, "accepted");
  EXPECT_EQ(refusal({.tip = "ball_bearing"}).what, "accepted");
}

TEST(RigConfiguration, ADeviceAndAnObjectOfOnesOwnTakeThePlaceOfThePresets) {
  DeviceModel device = device_preset("phantom_1_0").value();
  device.name = "stiffened";
  device.structural_stiffness_n_per_mm = 35.0;
  device.structural_mode_hz *= std::sqrt(10.0);
  ObjectModel object = object_preset("wood_plate").value();
  object.name = "harder wood";
  object.material.stiffness_at_4n_n_per_mm = 500.0;
  const auto rig =
      SimulatedRig::create({.device = "no one's", .custom_device = device, .custom_object = object});
  ASSERT_TRUE(rig) << rig.error().text();
  EXPECT_EQ((*rig)->info().device.model, "stiffened");
  EXPECT_EQ((*rig)->info().device.structural_stiffness_n_per_mm, 35.0);
  EXPECT_EQ((*rig)->object(), "harder wood");
}

TEST(RigConfiguration, APresetOfOnesOwnMovesAsThePresetItself) {
  const auto pressed = [](const SimulationConfig& config) {
    HandProgram press;
    press.kind = HandProgram::Kind::kPress;
    test::VirtualRig rig(config, press);
    rig.run(2.0);
    return rig.truth();
  };
  const hal::TruthSample named = pressed({.device = "phantom_1_0", .object = "rubber_ball"});
  const hal::TruthSample given = pressed({.device = "phantom_1_0",
                                          .object = "rubber_ball",
                                          .custom_device = device_preset("phantom_1_0"),
                                          .custom_object = object_preset("rubber_ball")});
  EXPECT_GT(named.displacement_mm, 0.5);
  EXPECT_EQ(named.tip_position_mm.z, given.tip_position_mm.z);
  EXPECT_EQ(named.hand_force_n.z, given.hand_force_n.z);
}

TEST(RigConfiguration, WhatCannotBeADeviceOrAnObjectIsRefused) {
  const std::string where = "custom device or object of a simulated rig";
  DeviceModel device = device_preset("phantom_1_0").value();
  device.command_latency_s = 2e-3;
  expect_error(refusal({.custom_device = device}), "command_latency_s is out of range", where, "0.002000",
               "0 … 0.0015 s");
  device = device_preset("phantom_1_0").value();
  device.structural_stiffness_n_per_mm = 35.0;  // a mode of 100 Hz needs more mass
  EXPECT_EQ(refusal({.custom_device = device}).what, "structural_mode_hz is out of range");
  ObjectModel object = object_preset("wood_plate").value();
  object.material.stiffness_at_4n_n_per_mm = kNan;
  expect_error(refusal({.custom_object = object}), "stiffness_at_4n_n_per_mm is out of range", where, "nan",
               "0.001 … 100000 N/mm");
}

TEST(RigConfiguration, RateIsFromHalfToTenKilohertz) {
  const std::string limit = "500 … 10000 Hz";
  expect_error(refusal({.rate_hz = 499.9}), "rate_hz is out of range", "[rig.sim]", "499.900000", limit);
  expect_error(refusal({.rate_hz = 10001.0}), "rate_hz is out of range", "[rig.sim]", "10001.000000", limit);
  expect_error(refusal({.rate_hz = -1000.0}), "rate_hz is out of range", "[rig.sim]", "-1000.000000", limit);
  expect_error(refusal({.rate_hz = kNan}), "rate_hz is out of range", "[rig.sim]", "nan", limit);
  expect_error(refusal({.rate_hz = kInfinity}), "rate_hz is out of range", "[rig.sim]", "inf", limit);
}

TEST(RigConfiguration, ToolMassIsUpToHalfAKilogram) {
  const std::string limit = "0 … 500 g";
  expect_error(refusal({.tool_mass_g = -0.1}), "tool_mass_g is out of range", "[rig.sim]", "-0.100000",
               limit);
  expect_error(refusal({.tool_mass_g = 501.0}), "tool_mass_g is out of range", "[rig.sim]", "501.000000",
               limit);
  expect_error(refusal({.tool_mass_g = kNan}), "tool_mass_g is out of range", "[rig.sim]", "nan", limit);
}

TEST(RigConfiguration, ModeIsOneThatMassAndStiffnessAdmit) {
  // Two free masses of fixed sum swing slowest when they are equal: ω² = 4 k / m. 3.5 N/mm and 75 g: 68.76
  // Hz.
  const hal::Error low = refusal({.structural_mode_hz = 68.7});
  EXPECT_EQ(low.what, "structural_mode_hz is out of range");
  EXPECT_EQ(low.where, "[rig.sim]");
  EXPECT_EQ(low.value, "68.700000");
  EXPECT_TRUE(low.limit.starts_with("68.76") && low.limit.find("… 1000 Hz") != std::string::npos)
      << low.limit;
  EXPECT_EQ(refusal({.structural_mode_hz = 68.8}).what, "accepted");
  EXPECT_EQ(refusal({.device = "phantom_1_5_high_force", .structural_mode_hz = 41.3}).what,
            "structural_mode_hz is out of range")
      << "2.537 N/mm and 150 g: 41.40 Hz";
  EXPECT_EQ(refusal({.device = "phantom_1_5_high_force", .structural_mode_hz = 41.5}).what, "accepted");
  EXPECT_EQ(refusal({.structural_mode_hz = 1000.1}).what, "structural_mode_hz is out of range");
  EXPECT_EQ(refusal({.structural_mode_hz = kNan}).what, "structural_mode_hz is out of range");
}

TEST(RigConfiguration, DampingAndPoleHaveTheirRanges) {
  expect_error(refusal({.structural_damping = 1.1}), "structural_damping is out of range", "[rig.sim]",
               "1.100000", "0 … 1");
  expect_error(refusal({.structural_damping = kNan}), "structural_damping is out of range", "[rig.sim]",
               "nan", "0 … 1");
  expect_error(refusal({.amplifier_pole_hz = 9.0}), "amplifier_pole_hz is out of range", "[rig.sim]",
               "9.000000", "10 … 100000 Hz");
  expect_error(refusal({.amplifier_pole_hz = kNan}), "amplifier_pole_hz is out of range", "[rig.sim]", "nan",
               "10 … 100000 Hz");
}

TEST(RigConfiguration, InformationSaysWhatWasMade) {
  test::VirtualRig made({.device = "phantom_1_5_high_force",
                         .object = "wood_plate",
                         .rate_hz = 2000.0,
                         .tool_mass_g = 12.0,
                         .structural_mode_hz = 130.0,
                         .structural_damping = 0.02,
                         .amplifier_pole_hz = 500.0});
  const hal::RigInfo& info = made.rig().info();
  EXPECT_EQ(info.kind, hal::RigKind::kSimulated);
  EXPECT_EQ(info.name, "sim:phantom_1_5_high_force");
  EXPECT_EQ(info.rate_hz, 2000.0);
  EXPECT_EQ(info.device.max_force_n, 37.5);
  EXPECT_EQ(info.device.coulomb_friction_n, 0.2);
  EXPECT_EQ(info.sensor.model, "nano17_si_25");
  EXPECT_DOUBLE_EQ(info.sensor.tool_mass_g, 12.0);
  EXPECT_TRUE(info.renders_force);
  EXPECT_TRUE(info.has_truth);
  EXPECT_TRUE(made.rig().owns_clock());
  EXPECT_EQ(made.rig().object(), "wood_plate");
  int overridden = 0;
  for (const hal::UncertainParameter& u : info.uncertain) {
    if (u.name == "structural_mode_hz") overridden += u.value == 130.0 ? 1 : 0;
    if (u.name == "structural_damping") overridden += u.value == 0.02 ? 1 : 0;
    if (u.name == "amplifier_pole_hz") overridden += u.value == 500.0 ? 1 : 0;
  }
  EXPECT_EQ(overridden, 3) << "figures must be readable together with what they rest on";
  EXPECT_FALSE(test::VirtualRig({.real_time = true}).rig().owns_clock());
}

TEST(RigConfiguration, UnknownObjectLeavesTheOldOne) {
  test::VirtualRig made({.object = "foam_ball"});
  const auto error = made.rig().set_object("anvil");
  ASSERT_TRUE(error);
  expect_error(*error, "unknown object", "simulated rig", "anvil", kObjects);
  EXPECT_EQ(made.rig().object(), "foam_ball");
  EXPECT_FALSE(made.rig().set_object("none"));
  EXPECT_EQ(made.rig().object(), "none");
}

struct Field {
  const char* name;
  double HandProgram::*member;
  double low, high;
  const char* unit;
};

const Field kFields[] = {{"force_n", &HandProgram::force_n, 0.0, 30.0, "N"},
                         {"depth_mm", &HandProgram::depth_mm, 0.0, 50.0, "mm"},
                         {"force_rate_n_per_s", &HandProgram::force_rate_n_per_s, 0.01, 100.0, "N/s"},
                         {"approach_mm_per_s", &HandProgram::approach_mm_per_s, 0.1, 500.0, "mm/s"},
                         {"speed_mm_per_s", &HandProgram::speed_mm_per_s, 1.0, 1500.0, "mm/s"},
                         {"rate_hz", &HandProgram::rate_hz, 0.05, 20.0, "Hz"},
                         {"hold_s", &HandProgram::hold_s, -1.0, 3600.0, "s"},
                         {"stroke_length_mm", &HandProgram::stroke_length_mm, 1.0, 150.0, "mm"},
                         {"mass_g", &HandProgram::mass_g, 1.0, 2000.0, "g"},
                         {"knock_n", &HandProgram::knock_n, 0.0, 20.0, "N"},
                         {"tap_slant_deg", &HandProgram::tap_slant_deg, 0.0, 60.0, "°"},
                         {"grip_stiffness_scale", &HandProgram::grip_stiffness_scale, 0.05, 20.0, ""},
                         {"grip_damping_scale", &HandProgram::grip_damping_scale, 0.0, 20.0, ""},
                         {"tilt_deg", &HandProgram::tilt_deg, 0.0, 60.0, "°"}};

TEST(HandProgramCheck, EveryFieldHasItsRange) {
  test::VirtualRig made({});
  for (const Field& field : kFields) {
    const std::string limit =
        std::to_string(field.low) + " … " + std::to_string(field.high) + " " + field.unit;
    const std::string what = std::string(field.name) + " is out of range";
    for (const double bad : {kNan, kInfinity, -kInfinity, field.low - 1.0, field.high + 1.0}) {
      HandProgram program;
      program.*field.member = bad;
      const auto error = made.rig().set_program(program);
      ASSERT_TRUE(error) << field.name << " = " << bad;
      expect_error(*error, what, "hand program", std::to_string(bad), limit);
    }
    for (const double good : {field.low, field.high}) {
      HandProgram program;
      program.*field.member = good;
      EXPECT_FALSE(made.rig().set_program(program)) << field.name << " = " << good;
    }
  }
}

TEST(HandProgramCheck, ADirectionNeedsALength) {
  test::VirtualRig made({});
  for (const hal::Vector3 bad : {hal::Vector3{0.0, 0.0, 0.0}, hal::Vector3{kNan, 0.0, 0.0},
                                 hal::Vector3{0.0, kInfinity, 0.0}, hal::Vector3{1e7, 0.0, 0.0}}) {
    HandProgram stroke;
    stroke.stroke_direction = bad;
    const auto stroke_error = made.rig().set_program(stroke);
    ASSERT_TRUE(stroke_error);
    EXPECT_EQ(stroke_error->what, "stroke_direction's length is out of range");
    EXPECT_EQ(stroke_error->where, "hand program");
    HandProgram shake;
    shake.shake_direction = bad;
    const auto shake_error = made.rig().set_program(shake);
    ASSERT_TRUE(shake_error);
    EXPECT_EQ(shake_error->what, "shake_direction's length is out of range");
    EXPECT_EQ(shake_error->where, "hand program");
  }
}

TEST(HandProgramCheck, ARefusedProgramChangesNothing) {
  test::VirtualRig untouched({.seed = 5}), refused({.seed = 5});
  for (int i = 0; i < 500; ++i) {
    HandProgram bad;
    bad.force_n = kNan;
    EXPECT_TRUE(refused.rig().set_program(bad));
    untouched.tick();
    refused.tick();
    ASSERT_EQ(untouched.truth().tip_position_mm.z, refused.truth().tip_position_mm.z);
  }
}

}  // namespace
}  // namespace hapticd::sim
