#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <filesystem>

#include "hal/openhaptics/config_folder.h"
#include "hal/openhaptics/device_figures.h"
#include "hd_bench.h"
#include "tests/support/temporary_folder.h"
#include "tests/support/value_of.h"

namespace hapticd::test {
namespace {

std::optional<hal::Error> refusal(const std::function<void(OpenHapticsConfig&)>& change) {
  OpenHapticsConfig config;
  change(config);
  auto device = OpenHapticsDevice::create(config);
  if (device) return std::nullopt;
  return device.error();
}

TEST(OpenHapticsConfiguration, TheDefaultIsSoundAndOpensNothing) {
  auto device = value_of(OpenHapticsDevice::create({}));
  EXPECT_EQ(device->report().state, hal::PartState::kIdle);
  EXPECT_EQ(device->clock(), device.get());
  EXPECT_EQ(device->info().model, "phantom_premium_1_5");
  EXPECT_DOUBLE_EQ(device->info().max_force_n, 8.5);
  EXPECT_DOUBLE_EQ(device->info().structural_stiffness_n_per_mm, 3.5);
}

TEST(OpenHapticsConfiguration, EveryValueHasItsRange) {
  const double nan = std::nan("");
  const std::vector<std::pair<const char*, std::function<void(OpenHapticsConfig&)>>> bad = {
      {"library", [](auto& c) { c.vendor_library_names = " , "; }},
      {"model", [](auto& c) { c.model = "phantom_9"; }},
      {"rate_hz", [](auto& c) { c.rate_hz = 0.0; }},
      {"rate_hz", [nan](auto& c) { c.rate_hz = nan; }},
      {"max_force_n", [](auto& c) { c.max_force_n = 0.0; }},
      {"max_continuous_force_n", [](auto& c) { c.max_continuous_force_n = -1.0; }},
      {"structural_stiffness_n_per_mm", [](auto& c) { c.structural_stiffness_n_per_mm = 1e3; }},
      {"apparent_mass_g", [nan](auto& c) { c.apparent_mass_g = nan; }},
      {"origin_mm.y", [](auto& c) { c.origin_mm.y = 1e4; }},
      {"tip_offset_mm.z", [nan](auto& c) { c.tip_offset_mm.z = nan; }},
      {"tool_to_stylus",
       [](auto& c) {
         c.tool_to_stylus = {1.0, 1.0, 0.0, 0.0};
       }},
      {"warm_share", [](auto& c) { c.warm_share = 2.0; }},
      {"calibration_wait_s", [](auto& c) { c.calibration_wait_s = -1.0; }},
      {"patience_s", [](auto& c) { c.timeout_s = 0.0; }},
      {"stall_s", [](auto& c) { c.stall_s = 0.0; }},
      {"death_s", [nan](auto& c) { c.death_s = nan; }},
  };
  for (const auto& [key, change] : bad) {
    const auto error = refusal(change);
    ASSERT_TRUE(error) << key;
    EXPECT_NE(error->where.find(key), std::string::npos) << error->text();
    EXPECT_FALSE(error->limit.empty()) << key;
  }
}

TEST(OpenHapticsConfiguration, OverridesTheDataSheet) {
  OpenHapticsConfig config;
  config.model = "phantom_omni";
  config.max_force_n = 2.0;
  config.structural_stiffness_n_per_mm = 0.0;
  config.apparent_mass_g = 50.0;
  config.position_resolution_mm = 0.01;
  auto device = value_of(OpenHapticsDevice::create(config));
  const hal::DeviceInfo& info = device->info();
  EXPECT_DOUBLE_EQ(info.max_force_n, 2.0);
  EXPECT_DOUBLE_EQ(info.max_continuous_force_n, 0.88);
  EXPECT_DOUBLE_EQ(info.structural_stiffness_n_per_mm, 0.0);
  EXPECT_DOUBLE_EQ(info.apparent_mass_g, 50.0);
  EXPECT_DOUBLE_EQ(info.position_resolution_mm, 0.01);
}

TEST(OpenHapticsConfiguration, AHighForceModelIsPointedToTheOtherDriverBeforeItIsOpened) {
  OpenHapticsConfig config;
  config.model = "phantom_premium_1_5_high_force";
  auto device = value_of(OpenHapticsDevice::create(config));
  ASSERT_EQ(device->report().findings.size(), 1U);
  EXPECT_NE(device->report().findings[0].find("hal/phantom"), std::string::npos);
  EXPECT_TRUE(openhaptics::names_high_force("PHANToM Premium 1.5 HighForce"));
  EXPECT_TRUE(openhaptics::names_high_force("Premium 1.5HF"));
  EXPECT_FALSE(openhaptics::names_high_force("PHANTOM Omni"));
}

TEST(OpenHapticsConfiguration, AFolderThatCannotBeReadIsNamed) {
  using openhaptics::config_folder_problem;
  const TemporaryFolder folder;
  const std::string missing = folder.path("missing");
  EXPECT_NE(config_folder_problem(missing.c_str(), nullptr).find(missing), std::string::npos);
  EXPECT_EQ(config_folder_problem(folder.path().c_str(), nullptr), "");
  // Without GTDD_HOME it is in the home folder.
  for (const char* not_set : {static_cast<const char*>(nullptr), ""}) {
    const std::string problem = config_folder_problem(not_set, folder.path().c_str());
    EXPECT_NE(problem.find(folder.path(".3dsystems")), std::string::npos) << problem;
    EXPECT_NE(problem.find("GTDD_HOME is not set"), std::string::npos) << problem;
    EXPECT_NE(config_folder_problem(not_set, nullptr), "");
  }
  // A file in it that is not there any more.
  std::filesystem::create_directory(folder.path("config"));
  folder.write("config/Default Device.config", "x");
  EXPECT_EQ(config_folder_problem(folder.path().c_str(), nullptr), "");
  std::filesystem::create_symlink("/nowhere", folder.path("config/Left Device.config"));
  EXPECT_NE(config_folder_problem(folder.path().c_str(), nullptr).find("Left Device.config"),
            std::string::npos);
}

TEST(OpenHapticsConfiguration, ADeviceThatIsNotFoundIsReportedWithItsFolder) {
  OpenHapticsConfig config;
  config.vendor_library_names = "/nowhere/libHD.so";
  auto device = value_of(OpenHapticsDevice::create(config));
  const TemporaryFolder folder;
  setenv("GTDD_HOME", folder.path("missing").c_str(), 1);
  ASSERT_TRUE(device->engage());
  const auto findings = device->report().findings;
  unsetenv("GTDD_HOME");
  ASSERT_FALSE(findings.empty());
  EXPECT_NE(findings.back().find(folder.path("missing")), std::string::npos) << findings.back();
}

}  // namespace
}  // namespace hapticd::test
