#include "server/rig_file/turntable_section.h"

#include <gtest/gtest.h>

#include "server/rig_file/turntable_factory.h"
#include "tests/support/refusals.h"

namespace hapticd::server {
namespace {

struct Read {
  TurntableConfig config;
  std::optional<hal::Error> error;
};

Read read(const std::string& text) {
  Read result;
  auto document = TomlDocument::parse(text, "rig.toml");
  if (!document) return {{}, document.error()};
  read_turntable(document->root().table("rig").table("turntable"), result.config);
  result.error = document->error();
  return result;
}

constexpr const char* kWhole = R"(
[rig.turntable]
kind = "modbus"
min_deg = -90
max_deg = 270
tolerance_deg = 0.1
[rig.turntable.stations.sponge]
angle_deg = 0
object = "sponge_block"
[rig.turntable.stations.rubber]
angle_deg = 90.5
[rig.turntable.interlock]
contact_force_n = 0.2
[rig.turntable.modbus]
transport = "rtu"
device = "/dev/ttyS4"
parity = "none"
steps_per_motor_turn = 1000
motor_turns_per_turn = 18
map = "oriental_az"
)";

TEST(TurntableSection, IsReadWholeAndReadsBackAsTheSame) {
  const Read whole = read(kWhole);
  ASSERT_FALSE(whole.error) << whole.error->text();
  EXPECT_EQ(whole.config.kind, TurntableChoice::kModbus);
  EXPECT_EQ(whole.config.settings.max_deg, 270.0);
  ASSERT_EQ(whole.config.settings.stations.size(), 2U);
  EXPECT_EQ(whole.config.settings.stations[1].object, "sponge_block");
  EXPECT_EQ(whole.config.modbus.link.parity, 'N');
  EXPECT_EQ(whole.config.modbus.map.name, "oriental_az");
  EXPECT_EQ(whole.config.interlock.contact_force_n, 0.2);
  const std::string written = write_turntable(whole.config);
  const Read again = read(written);
  ASSERT_FALSE(again.error) << again.error->text() << written;
  EXPECT_EQ(write_turntable(again.config), written);
  EXPECT_TRUE(again.config.modbus.map == whole.config.modbus.map);
  EXPECT_TRUE(again.config.modbus.link == whole.config.modbus.link);
}

TEST(TurntableSection, AMapMayBeReportedInTheFileItself) {
  TurntableConfig config = read(kWhole).config;
  config.map.clear();
  const std::string written = write_turntable(config);
  EXPECT_NE(written.find("[rig.turntable.modbus.inline.registers.feedback_position]"), std::string::npos);
  const Read again = read(written);
  ASSERT_FALSE(again.error) << again.error->text();
  EXPECT_EQ(again.config.map, "");
  EXPECT_EQ(write_turntable(again.config), written);
  EXPECT_EQ(again.config.modbus.map.registers.size(), config.modbus.map.registers.size());
}

TEST(TurntableSection, DefaultsAreNoTurntable) {
  const Read none = read("");
  ASSERT_FALSE(none.error);
  EXPECT_EQ(none.config.kind, TurntableChoice::kNone);
  const auto table = make_turntable(none.config);
  ASSERT_TRUE(table);
  EXPECT_EQ(table->get(), nullptr);
  const Read again = read(write_turntable(none.config));
  ASSERT_FALSE(again.error) << again.error->text();
}

TEST(TurntableSection, RefusesByName) {
  using enum hal::ErrorCode;
  test::expect_refusals(
      {
          {"[rig.turntable]\nspeed = 3", "'speed' in [rig.turntable]", kUnknownKey, 2},
          {"[rig.turntable]\nkind = \"motor\"", "'rig.turntable.kind'", kUnknownWord, 2},
          {"[rig.turntable]\npoll_hz = 0", "'rig.turntable.poll_hz'", kOutOfRange, 2},
          {"[rig.turntable.stations.a]\nangle = 1", "angle", kMissingKey, 1},
          {"[rig.turntable.stations.a]\nangle_deg = 1\nangel = 1", "'angel' in [rig.turntable.stations.a]",
           kUnknownKey, 3},
          {"[rig.turntable.stations.\"a.b\"]\nangle_deg = 1", "name", kMalformed, 1},
          {"[rig.turntable]\nstations = 3", "'rig.turntable.stations'", kWrongType, 2},
          {"[rig.turntable.modbus]\nmap = \"plain_drve\"", "register map", kNotFound, 2, "plain_drive"},
          {"[rig.turntable.modbus]\nmap = \"/nowhere/map.toml\"", "/nowhere/map.toml", kNotFound, 2},
          {"[rig.turntable.modbus]\nmap = \"plain_drive\"\n[rig.turntable.modbus.inline]\nsource = \"x\"",
           "register map", kContradiction, 2},
          {"[rig.turntable.modbus.inline]\nsource = \"x\"", "position_actual", kMissingKey, 1},
          {"[rig.turntable.sim]\nhomed = 1", "'rig.turntable.sim.homed'", kWrongType, 2},
      },
      [](const std::string& text) -> hal::Result<TurntableConfig> {
        const Read result = read(text);
        if (result.error) return *result.error;
        return result.config;
      });
}

TEST(TurntableSection, ContradictionsAreReportedWhenTheTableIsMade) {
  using enum hal::ErrorCode;
  TurntableConfig config;
  config.kind = TurntableChoice::kSimulated;
  config.settings.stations = {{"a", 10.0, ""}, {"b", 10.1, ""}};
  EXPECT_EQ(make_turntable(config).error().code, kContradiction);
  config.settings.stations = {{"a", 500.0, ""}};
  EXPECT_EQ(make_turntable(config).error().code, kOutOfRange);
  config.settings.stations.clear();
  config.settings.stale_after_s = 0.02;
  EXPECT_EQ(make_turntable(config).error().code, kContradiction);
  config = read(kWhole).config;
  config.modbus.link.baud = 1234;
  EXPECT_EQ(make_turntable(config).error().code, kOutOfRange);
}

}  // namespace
}  // namespace hapticd::server
