#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <set>

#include "hal/phantom/phantom_config.h"

namespace hapticd::phantom {
namespace {

bool reports(const PhantomConfig& config, const std::string& name, const std::string& source) {
  const auto list = uncertain_parameters(config);
  return std::any_of(list.begin(), list.end(), [&](const hal::UncertainParameter& p) {
    return p.name == name && p.source.find(source) != std::string::npos;
  });
}

TEST(PhantomConfig, PresetsMakeSense) {
  for (const std::string& model : phantom_presets()) {
    const auto preset = phantom_preset(model);
    ASSERT_TRUE(preset);
    EXPECT_EQ(preset->model, model);
    const auto error = check(*preset);
    EXPECT_FALSE(error) << error->text();
  }
  EXPECT_FALSE(phantom_preset("phantom_omni"));
  EXPECT_EQ(PhantomConfig{}.model, "phantom_premium_1_5");
}

TEST(PhantomConfig, WhatNoSheetSaysIsReportedWithItsSource) {
  for (const std::string& model : phantom_presets()) {
    const PhantomConfig config = *phantom_preset(model);
    EXPECT_TRUE(reports(config, "amplifier_gain_a_per_v", "assumed")) << model;
    EXPECT_TRUE(reports(config, "thermal_time_constant_s", "assumed")) << model;
    std::set<std::string> names;
    for (const auto& parameter : uncertain_parameters(config)) {
      EXPECT_TRUE(names.insert(parameter.name).second) << parameter.name << " twice";
      EXPECT_FALSE(parameter.source.empty());
      EXPECT_FALSE(parameter.unit.empty());
    }
  }
  EXPECT_TRUE(
      reports(*phantom_preset("phantom_premium_1_5_high_force"), "torque_constant_n_mm_per_a", "assumed"));
  EXPECT_FALSE(reports(PhantomConfig{}, "torque_constant_n_mm_per_a", "")) << "the 1.5's is published";
  PhantomConfig measured{.amplifier_gain_a_per_v = {0.5, 0.5, 0.5}};
  EXPECT_TRUE(reports(measured, "amplifier_gain_a_per_v", "configuration"));
}

TEST(PhantomConfig, ValuesThatMakeNoSenseAreNamed) {
  const auto error_of = [](auto change) {
    PhantomConfig config;
    change(config);
    const auto error = check(config);
    return error ? error->what + " " + error->limit : std::string("fine");
  };
  const auto refuses = [&](const std::string& name, auto change) {
    return error_of(change).find(name) != std::string::npos;
  };
  EXPECT_TRUE(refuses("unknown device model", [](auto& c) { c.model = "phantom_3"; }));
  EXPECT_TRUE(refuses("first_link_mm", [](auto& c) { c.arm.first_link_mm = 0.0; }));
  EXPECT_TRUE(refuses("transmission", [](auto& c) { c.transmission[1] = -11.2; }));
  EXPECT_TRUE(refuses("encoder_sign", [](auto& c) { c.encoder_sign[0] = 0.5; }));
  EXPECT_TRUE(refuses("motor_sign", [](auto& c) { c.motor_sign[2] = 0.0; }));
  EXPECT_TRUE(refuses("torque_constant", [](auto& c) {
    c.torque_constant_n_mm_per_a[0] = std::numeric_limits<double>::quiet_NaN();
  }));
  EXPECT_TRUE(refuses("amplifier_gain", [](auto& c) { c.amplifier_gain_a_per_v[0] = 0.0; }));
  EXPECT_TRUE(refuses("continuous_current_a", [](auto& c) { c.continuous_current_a[0] = 99.0; }));
  EXPECT_TRUE(refuses("watchdog_ms", [](auto& c) { c.watchdog_ms = 0.0; }));
  EXPECT_TRUE(refuses("reset_pose_rad", [](auto& c) { c.reset_pose_rad = {0.0, 1.5, 0.0}; }));
  EXPECT_TRUE(refuses("joint_high_rad", [](auto& c) { c.arm.high_rad[0] = -3.0; }));
  EXPECT_TRUE(refuses("gimbal_counts", [](auto& c) { c.gimbal_counts_per_turn[0] = 0.0; }));
}

}  // namespace
}  // namespace hapticd::phantom
