// Device presets against the data sheets they come from.

#include "hal/sim/device/device_model.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

namespace hapticd::sim {
namespace {

TEST(DevicePreset, Phantom10HasTheLimitsOfItsDataSheet) {
  const auto device = device_preset("phantom_1_0");
  ASSERT_TRUE(device);
  EXPECT_EQ(device->max_force_n, 8.5);
  EXPECT_EQ(device->max_continuous_force_n, 1.4);
  EXPECT_LE(device->apparent_mass_kg, 0.075);
  EXPECT_EQ(device->encoder_resolution_mm, 0.03);
  EXPECT_EQ(device->structural_stiffness_n_per_mm, 3.5);
  EXPECT_EQ(device->coulomb_friction_n, 0.06);
}

TEST(DevicePreset, HighForceHasTheLimitsOfItsDataSheetAndTheMeasuredStructure) {
  const auto device = device_preset("phantom_1_5_high_force");
  ASSERT_TRUE(device);
  EXPECT_EQ(device->max_force_n, 37.5);
  EXPECT_EQ(device->max_continuous_force_n, 6.2);
  EXPECT_LE(device->apparent_mass_kg, 0.150);
  EXPECT_EQ(device->encoder_resolution_mm, 0.007);
  EXPECT_EQ(device->structural_stiffness_n_per_mm, 2.537);
  EXPECT_EQ(device->coulomb_friction_n, 0.2);
}

TEST(DevicePreset, InformationIsThatOfTheModelInItsUnits) {
  for (const std::string& name : device_preset_names()) {
    const auto device = device_preset(name);
    ASSERT_TRUE(device) << name;
    const hal::DeviceInfo info = device->info();
    EXPECT_EQ(info.model, name);
    EXPECT_EQ(info.max_force_n, device->max_force_n);
    EXPECT_EQ(info.max_continuous_force_n, device->max_continuous_force_n);
    EXPECT_EQ(info.position_resolution_mm, device->encoder_resolution_mm);
    EXPECT_EQ(info.structural_stiffness_n_per_mm, device->structural_stiffness_n_per_mm);
    EXPECT_DOUBLE_EQ(info.apparent_mass_g, 1000.0 * device->apparent_mass_kg);
    EXPECT_EQ(info.coulomb_friction_n, device->coulomb_friction_n);
    EXPECT_EQ(device->command_latency_s, 0.001) << "one tick";
  }
}

TEST(DevicePreset, ReportsWhatIsUncertain) {
  for (const std::string& name : device_preset_names()) {
    const auto uncertain = device_preset(name)->uncertain();
    for (const char* parameter :
         {"structural_mode_hz", "structural_damping", "amplifier_pole_hz", "dac_bits"}) {
      const auto found = std::find_if(uncertain.begin(), uncertain.end(),
                                      [&](const hal::UncertainParameter& u) { return u.name == parameter; });
      ASSERT_NE(found, uncertain.end()) << name << " " << parameter;
      EXPECT_TRUE(std::isfinite(found->value) && found->value > 0.0) << parameter;
      EXPECT_FALSE(found->source.empty()) << parameter;
    }
  }
}

}  // namespace
}  // namespace hapticd::sim
