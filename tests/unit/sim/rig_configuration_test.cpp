// What the rig refuses.

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <optional>
#include <string>

#include "hal/shown_text.h"
#include "hal/sim/simulated_rig.h"
#include "tests/support/value_of.h"
#include "virtual_rig.h"

namespace hapticd::sim {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kInfinity = std::numeric_limits<double>::infinity();

void expect_refused(const std::optional<hal::Error>& error, const std::string& key, hal::ErrorCode code,
                    const std::string& limit) {
  SCOPED_TRACE(key);
  ASSERT_TRUE(error) << "it is accepted";
  EXPECT_NE((error->where + ": " + error->what).find(key), std::string::npos) << error->text();
  EXPECT_EQ(static_cast<int>(error->code), static_cast<int>(code)) << error->text();
  EXPECT_NE(error->limit.find(limit), std::string::npos) << error->text();
}

std::optional<hal::Error> refusal(const SimulationConfig& config) {
  const auto rig = SimulatedRig::create(config);
  if (rig) return std::nullopt;
  return rig.error();
}

TEST(RigConfiguration, WhatItIsMadeOfHasNamesAndRanges) {
  using enum hal::ErrorCode;
  DeviceModel late = device_preset("phantom_1_0").value();
  late.command_latency_s = 2e-3;
  DeviceModel stiff = device_preset("phantom_1_0").value();
  stiff.structural_stiffness_n_per_mm = 35.0;  // a mode of 100 Hz needs more mass
  ObjectModel shapeless = object_preset("wood_plate").value();
  shapeless.material.stiffness_at_4n_n_per_mm = kNan;
  const struct {
    SimulationConfig config;
    const char* key;
    hal::ErrorCode code;
    const char* limit;
  } cases[] = {
      {{.device = "phantom_2_0"}, "[rig.sim] device", kUnknownWord, "phantom_1_0, phantom_1_5_high_force"},
      {{.object = "anvil"}, "unknown object", kUnknownWord, "sponge_block, foam_ball, "},
      {{.tip = "needle"}, "[rig.sim] tip", kUnknownWord, "rod, ball_bearing"},
      {{.plant = "linear"}, "[rig.sim] plant", kUnknownWord, "separable, general"},
      {{.custom_device = late}, "command_latency_s", kOutOfRange, "0 … 0.0015 s"},
      {{.custom_device = stiff}, "structural_mode_hz", kOutOfRange, "1000 Hz"},
      {{.custom_object = shapeless}, "stiffness_at_4n_n_per_mm", kOutOfRange, "0.001 … 100000 N/mm"},
      {{.rate_hz = 499.9}, "rate_hz", kOutOfRange, "500 … 10000 Hz"},
      {{.rate_hz = 10001.0}, "rate_hz", kOutOfRange, "500 … 10000 Hz"},
      {{.rate_hz = kNan}, "rate_hz", kOutOfRange, "500 … 10000 Hz"},
      {{.tool_mass_g = -0.1}, "tool_mass_g", kOutOfRange, "0 … 500 g"},
      {{.tool_mass_g = 501.0}, "tool_mass_g", kOutOfRange, "0 … 500 g"},
      {{.tool_mass_g = kNan}, "tool_mass_g", kOutOfRange, "0 … 500 g"},
      // Two free masses of fixed sum swing slowest when they are equal: ω² = 4 k / m. 3.5 N/mm and 75 g:
      // 68.76 Hz; 2.537 N/mm and 150 g: 41.40 Hz.
      {{.structural_mode_hz = 68.7}, "structural_mode_hz", kOutOfRange, "68.76"},
      {{.device = "phantom_1_5_high_force", .structural_mode_hz = 41.3},
       "structural_mode_hz",
       kOutOfRange,
       "41.39"},
      {{.structural_mode_hz = 1000.1}, "structural_mode_hz", kOutOfRange, "1000 Hz"},
      {{.structural_mode_hz = kNan}, "structural_mode_hz", kOutOfRange, "1000 Hz"},
      {{.structural_damping = 1.1}, "structural_damping", kOutOfRange, "0 … 1"},
      {{.structural_damping = kNan}, "structural_damping", kOutOfRange, "0 … 1"},
      {{.amplifier_pole_hz = 9.0}, "amplifier_pole_hz", kOutOfRange, "10 … 100000 Hz"},
      {{.amplifier_pole_hz = kNan}, "amplifier_pole_hz", kOutOfRange, "10 … 100000 Hz"},
  };
  for (const auto& one : cases) expect_refused(refusal(one.config), one.key, one.code, one.limit);
  for (const SimulationConfig& good :
       {SimulationConfig{.tip = "rod"}, SimulationConfig{.tip = "ball_bearing"},
        SimulationConfig{.structural_mode_hz = 68.8},
        SimulationConfig{.device = "phantom_1_5_high_force", .structural_mode_hz = 41.5}}) {
    EXPECT_FALSE(refusal(good));
  }
}

TEST(RigConfiguration, ADeviceAndAnObjectOfOnesOwnTakeThePlaceOfThePresets) {
  DeviceModel device = device_preset("phantom_1_0").value();
  device.name = "stiffened";
  device.structural_stiffness_n_per_mm = 35.0;
  device.structural_mode_hz *= std::sqrt(10.0);
  ObjectModel object = object_preset("wood_plate").value();
  object.name = "harder wood";
  object.material.stiffness_at_4n_n_per_mm = 500.0;
  const auto rig = test::value_of(
      SimulatedRig::create({.device = "no one's", .custom_device = device, .custom_object = object}));
  EXPECT_EQ(rig->info().device.model, "stiffened");
  EXPECT_EQ(rig->info().device.structural_stiffness_n_per_mm, 35.0);
  EXPECT_EQ(rig->object(), "harder wood");
}

TEST(RigConfiguration, APresetOfOnesOwnMovesAsThePresetItself) {
  const auto pressed = [](const SimulationConfig& config) {
    test::VirtualRig rig(config, {.kind = HandProgram::Kind::kPress});
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
  expect_refused(made.rig().set_object("anvil"), "unknown object", hal::ErrorCode::kUnknownWord, "none");
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
    std::string limit = hal::number_text(field.low) + " … " + hal::number_text(field.high);
    if (*field.unit != '\0') limit += std::string(" ") + field.unit;
    for (const double bad : {kNan, kInfinity, -kInfinity, field.low - 1.0, field.high + 1.0}) {
      HandProgram program;
      program.*field.member = bad;
      expect_refused(made.rig().set_program(program), field.name, hal::ErrorCode::kOutOfRange, limit);
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
    HandProgram stroke{.stroke_direction = bad};
    expect_refused(made.rig().set_program(stroke), "stroke_direction's length", hal::ErrorCode::kOutOfRange,
                   "");
    HandProgram shake{.shake_direction = bad};
    expect_refused(made.rig().set_program(shake), "shake_direction's length", hal::ErrorCode::kOutOfRange,
                   "");
  }
}

TEST(HandProgramCheck, ARefusedProgramChangesNothing) {
  test::VirtualRig untouched({.seed = 5}), refused({.seed = 5});
  for (int i = 0; i < 500; ++i) {
    EXPECT_TRUE(refused.rig().set_program({.force_n = kNan}));
    untouched.tick();
    refused.tick();
    ASSERT_EQ(untouched.truth().tip_position_mm.z, refused.truth().tip_position_mm.z);
  }
}

}  // namespace
}  // namespace hapticd::sim
