#include "server/rig_file/openhaptics_section.h"

#include <gtest/gtest.h>

namespace hapticd::server {
namespace {

hal::Result<openhaptics::OpenHapticsConfig> read(const std::string& text) {
  auto document = TomlDocument::parse(text, "rig.toml");
  if (!document) return document.error();
  openhaptics::OpenHapticsConfig config;
  read_openhaptics(document->root(), config);
  if (auto error = document->error()) return *error;
  return config;
}

TEST(OpenHapticsSection, NothingSaidMeansTheDefaultsWhichAreSound) {
  const auto config = read("");
  ASSERT_TRUE(config) << config.error().text();
  EXPECT_FALSE(openhaptics::check(*config));
  EXPECT_EQ(config->libraries().front(), "libHD.so");
  EXPECT_EQ(config->libraries().size(), 7U);
}

TEST(OpenHapticsSection, WhatIsWrittenReadsBackAsTheSame) {
  const std::string all = R"(library = "libHD.so.3.4, /opt/a \"b\"/libHD.so"
device_name = "left one"
model = "phantom_omni"
rate_hz = 500.0
max_force_n = 2.5
max_continuous_force_n = 0.7
structural_stiffness_n_per_mm = 0.0
apparent_mass_g = 50.0
position_resolution_mm = 0.05
origin_mm = [1.0, -2.5, 3.0]
tip_offset_mm = [0.0, 0.0, -60.0]
tool_to_stylus = [0.0, 0.6, 0.0, -0.8]
warm_share = 0.8
reset_encoders = true
calibration_wait_s = 0.0
patience_s = 3.0
stall_s = 0.05
death_s = 2.0
)";
  const auto config = read(all);
  ASSERT_TRUE(config) << config.error().text();
  EXPECT_EQ(write_openhaptics(*config), all);
  EXPECT_EQ(config->libraries()[1], "/opt/a \"b\"/libHD.so");
  const std::string defaults = write_openhaptics({});
  const auto again = read(defaults);
  ASSERT_TRUE(again) << again.error().text();
  EXPECT_EQ(write_openhaptics(*again), defaults);
}

TEST(OpenHapticsSection, WhatIsWrongIsReportedByNameAndLine) {
  const struct {
    const char *text, *key;
  } cases[] = {
      {"rate_hz = 0", "rate_hz"},
      {"model = \"phantom_omny\"", "phantom_omni"},  // and what was meant
      {"library = \" ,\"", "library"},
      {"max_force_n = -1", "max_force_n"},
      {"origin_mm = [1, 2]", "origin_mm"},
      {"tool_to_stylus = [1, 1, 0, 0]", "tool_to_stylus"},
      {"reset_encoders = 1", "reset_encoders"},
      {"death_s = nan", "death_s"},
      {"max_force = 1", "max_force_n"},
  };
  for (const auto& one : cases) {
    const auto config = read(std::string("\n") + one.text);
    ASSERT_FALSE(config) << one.text;
    EXPECT_NE(config.error().text().find(one.key), std::string::npos) << config.error().text();
    EXPECT_NE(config.error().where.find("line 2"), std::string::npos) << config.error().text();
  }
}

}  // namespace
}  // namespace hapticd::server
