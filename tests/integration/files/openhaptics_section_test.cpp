#include "server/rig_file/openhaptics_section.h"

#include <gtest/gtest.h>

#include "tests/support/refusals.h"
#include "tests/support/value_of.h"

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
  const auto config = test::value_of(read(""));
  EXPECT_FALSE(openhaptics::check(config));
  EXPECT_EQ(config.libraries().front(), "libHD.so");
  EXPECT_EQ(config.libraries().size(), 7U);
}

TEST(OpenHapticsSection, WhatIsWrittenReadsBackAsTheSame) {
  const std::string all = R"(library = "libHD.so.3.4, /opt/a \"b\"/libHD.so"
device_name = "left one"
model = "phantom_omni"
rate_hz = 500.0
max_force_n = 2.5
max_continuous_force_n = 0.7
structural_stiffness_n_per_mm = 0.0
structural_mode_hz = 110.0
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
  const auto config = test::value_of(read(all));
  EXPECT_EQ(write_openhaptics(config), all);
  EXPECT_EQ(config.libraries()[1], "/opt/a \"b\"/libHD.so");
  const std::string defaults = write_openhaptics({});
  const auto again = test::value_of(read(defaults));
  EXPECT_EQ(write_openhaptics(again), defaults);
}

TEST(OpenHapticsSection, WhatIsWrongIsReportedByNameAndLine) {
  using enum hal::ErrorCode;
  test::expect_refusals(
      {
          {"\nrate_hz = 0", "'rate_hz'", kOutOfRange, 2},
          {"\nmodel = \"phantom_omny\"", "model", kUnknownWord, 2},
          {"\nlibrary = \" ,\"", "library", kMalformed, 2},
          {"\nmax_force_n = -1", "'max_force_n'", kOutOfRange, 2},
          {"\norigin_mm = [1, 2]", "'origin_mm'", kWrongType, 2},
          {"\ntool_to_stylus = [1, 1, 0, 0]", "'tool_to_stylus'", kMalformed, 2},
          {"\nreset_encoders = 1", "'reset_encoders'", kWrongType, 2},
          {"\ndeath_s = nan", "'death_s'", kNotFinite, 2},
          {"\nmax_force = 1", "'max_force'", kUnknownKey, 2},
      },
      read);
}

}  // namespace
}  // namespace hapticd::server
