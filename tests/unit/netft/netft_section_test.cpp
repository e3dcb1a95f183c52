#include "server/rig_file/netft_section.h"

#include <gtest/gtest.h>

#include "tests/support/refusals.h"
#include "tests/support/value_of.h"

namespace hapticd::server {
namespace {

hal::Result<netft::NetFtConfig> parse(const std::string& text) {
  auto document = TomlDocument::parse(text, "rig.toml");
  if (!document) return document.error();
  netft::NetFtConfig config;
  read_netft(document->root(), config);
  if (auto error = document->error()) return *error;
  return config;
}

TEST(NetFtSection, DefaultsWrittenOutReadBackAsTheSame) {
  const std::string text = write_netft(netft::NetFtConfig{});
  const auto config = test::value_of(parse(text));
  EXPECT_EQ(write_netft(config), text);
  EXPECT_EQ(write_netft(*parse("")), text);
}

TEST(NetFtSection, EveryKeyIsReadAndWritten) {
  const std::string text =
      "address = \"10.1.2.3\"\nrdt_port = 49153\nhttp_port = 8080\nhttp_path = \"/x.xml\"\nrate_hz = 5000.0\n"
      "lowest_rate_hz = 900.0\nconnect_timeout_s = 2.5\nstale_after_ms = 50.0\nretry_first_ms = 25.0\n"
      "retry_longest_ms = 500.0\nbias = \"box\"\nmodel = \"nano17_si_12\"\nserial = \"FT1\"\nlow_pass_hz = "
      "838.0\n"
      "tool_mass_g = 11.5\naxes = \"+y -x +z\"\nread_configuration = false\ncounts_per_force = 4448.0\n"
      "counts_per_torque = 200.0\nforce_unit = \"lbf\"\ntorque_unit = \"lbf-in\"\nfifo_priority = 0\n";
  const auto config = test::value_of(parse(text));
  EXPECT_EQ(write_netft(config), text);
  EXPECT_EQ(config.bias, netft::BiasBy::kBox);
  EXPECT_EQ(config.low_pass_hz, 838.0);
  // None of them is a default: all 22 lines were read.
  const std::string defaults = write_netft(netft::NetFtConfig{});
  std::size_t lines = 0;
  for (std::size_t begin = 0; begin < text.size(); begin = text.find('\n', begin) + 1) {
    const std::string line = text.substr(begin, text.find('\n', begin) - begin + 1);
    EXPECT_EQ(defaults.find(line), std::string::npos) << line;
    ++lines;
  }
  EXPECT_EQ(lines, 22U);
}

TEST(NetFtSection, RefusesUnknownKeysAndValuesOutOfRangeByLine) {
  using enum hal::ErrorCode;
  test::expect_refusals(
      {
          {"address = \"10.0.0.1\"\nrate_khz = 7\n", "'rate_khz'", kUnknownKey, 2, "rate_hz"},
          {"rdt_port = 70000", "'rdt_port'", kOutOfRange, 1},
          {"bias = \"hardware\"", "'bias'", kUnknownWord, 1},
          {"connect_timeout_s = 0", "'connect_timeout_s'", kOutOfRange, 1},
          {"stale_after_ms = nan", "'stale_after_ms'", kNotFinite, 1},
          {"axes = 3", "'axes'", kWrongType, 1},
          {"low_pass_hz = -1", "'low_pass_hz'", kOutOfRange, 1},
      },
      parse);
}

}  // namespace
}  // namespace hapticd::server
