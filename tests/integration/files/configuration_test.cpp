#include <gtest/gtest.h>
#include <sys/stat.h>

#include <array>

#include "hal/daq/board_factory.h"
#include "server/config/config.h"
#include "server/rig/rig_factory.h"
#include "server/rig_file/turntable_map.h"
#include "tests/support/refusals.h"
#include "tests/support/temporary_folder.h"
#include "tests/support/value_of.h"

namespace hapticd::server {
namespace {

hal::Result<DaemonConfig> read_configuration(const std::string& text) {
  return parse_config(text, "hapticd.toml");
}

TEST(Configuration, WhatIsWrittenReadsBackAsTheSame) {
  const auto config = test::value_of(parse_config(R"(
[loop]
rate_hz = 2500
fifo_priority = 42
cpu = 0
wake_early_share = 0.25
lock_memory = false
keep_cpu_awake = false
[network]
listen = "[::1]:7"
unix_socket = "/run/hapticd/a \"strange\" one.sock"
[rig]
kind = "replay"
[rig.sim]
device = "phantom_1_5_high_force"
object = "rubber_ball"
tip = "ball_bearing"
plant = "general"
seed = 7
structural_mode_hz = 123.5
structural_damping = 0.01
amplifier_pole_hz = 400
tool_mass_g = 12.59
[rig.replay]
path = "run.csv"
speed = "fast"
loop = true
bias_s = 0.25
decimal_comma = true
force = { column = "load_uN", unit = "uN", scale = 1e-3 }
position = { column = "tip_um" }
[scene]
load = "tap_1d"
folder = "/etc/hapticd/scenes"
[models]
folder = "/etc/hapticd/models"
store = "/var/lib/hapticd/models.sqlite"
[log]
level = "debug"
)",
                                                  "hapticd.toml"));
  const std::string text = write_config(config);
  const auto again = test::value_of(parse_config(text, "written"));
  EXPECT_EQ(write_config(again), text);
  EXPECT_EQ(again.loop.rate_hz, 2500.0);
  EXPECT_EQ(again.loop.wake_early_share, 0.25);
  EXPECT_EQ(again.listen.text(), "[::1]:7");
  EXPECT_EQ(again.unix_socket, "/run/hapticd/a \"strange\" one.sock");
  EXPECT_EQ(again.simulation.structural_mode_hz, 123.5);
  EXPECT_EQ(again.simulation.structural_damping, 0.01);
  EXPECT_TRUE(again.replay.as_fast_as_possible);
  EXPECT_EQ(again.replay.force.scale, 1e-3);
  EXPECT_EQ(again.simulation.tip, "ball_bearing");
  EXPECT_EQ(again.simulation.plant, "general");
  EXPECT_EQ(again.model_folder, "/etc/hapticd/models");
  EXPECT_EQ(again.model_store, "/var/lib/hapticd/models.sqlite");
  EXPECT_EQ(again.log_level, LogLevel::kDebug);
}

TEST(Configuration, APipeThatNobodyWritesIsRefused) {
  const test::TemporaryFolder folder;
  const std::string pipe = folder.path("pipe.toml");
  ASSERT_EQ(mkfifo(pipe.c_str(), 0600), 0);
  const auto config = read_config(pipe);
  ASSERT_FALSE(config);
  EXPECT_EQ(config.error().value, "a pipe");
  EXPECT_FALSE(find_turntable_map(pipe));
}

TEST(Configuration, ARefusalHasFivePartsAndACode) {
  using enum hal::ErrorCode;
  const hal::Error refused = test::error_of(read_configuration("[loop]\nrate_hz = 1000\nfifo_prioity = 3\n"));
  test::expect_same(refused, {"unknown key 'fifo_prioity' in [loop]", "hapticd.toml, line 3", "",
                              "rate_hz, fifo_priority, cpu, wake_early_share, lock_memory, keep_cpu_awake",
                              "did you mean 'fifo_priority'?", kUnknownKey});
}

TEST(Configuration, WhatIsWrongIsRefusedByKeyAndLine) {
  using enum hal::ErrorCode;
  test::expect_refusals(
      {
          {"[lop]\nrate_hz = 1000\n", "'lop'", kUnknownKey, 1},
          {"[rig.sim]\nforce = 3\n", "'force' in [rig.sim]", kUnknownKey, 2},
          {"[rig.netft]\nadress = \"10.0.0.2\"\n", "'adress' in [rig.netft]", kUnknownKey, 2},
          {"[loop]\nrat_hz = 1\n[rig.sim]\ntool_mass_g = -1\n", "'rat_hz'", kUnknownKey, 2},  // the first
          {"[loop]\nrate_hz = 99000\n", "'loop.rate_hz'", kOutOfRange, 2, "500 … 10000 Hz"},
          {"[loop]\nrate_hz = nan\n", "'loop.rate_hz'", kNotFinite, 2},
          {"[loop]\nrate_hz = \"fast\"\n", "'loop.rate_hz'", kWrongType, 2},
          {"[loop]\nrate_hz = = 3\n", "hapticd.toml, line 2, column 11", kSyntax},
          {"[loop]\ncpu = 1.5\n", "'loop.cpu'", kWrongType, 2, "-1 … 1023"},
          {"loop = 3\n", "'loop'", kWrongType, 1},
          {"[rig.sim]\ntool_mass_g = -1.5\n", "'rig.sim.tool_mass_g'", kOutOfRange, 2, "0 … 500 g"},
          {"[rig.sim.conditions]\nsensor_drift_n_per_s = 5\n", "'rig.sim.conditions.sensor_drift_n_per_s'",
           kOutOfRange, 2, "0 … 0.01 N/s"},
          {"[rig]\nkind = \"simm\"\n", "'rig.kind'", kUnknownWord, 2, "sim, replay, hardware"},
          {"[rig]\ndevice = \"openhaptic\"\n", "'rig.device'", kUnknownWord, 2,
           "of_kind, openhaptics, phantom"},
          {"[access.users]\nanna = \"root\"\n", "'access.users.anna'", kUnknownWord, 2},
          // lines that would apply to nobody
          {"[access.users]\n\"user:anna\" = \"observer\"\n", "'access.users.user:anna'", kMalformed, 2,
           "':'"},
          {"[access.groups]\n\"spiffe://a/b\" = \"observer\"\n", "'access.groups.spiffe", kMalformed, 2},
          {"[access.certificates]\nanna = \"observer\"\n", "'access.certificates.anna'", kMalformed, 2,
           "spiffe://LAB/hapticd/ROLE/NAME"},
          {"[access.denied]\nlocal = \"no\"\nben = \"left\"\n", "'access.denied.ben'", kMalformed, 3,
           "user:NAME, unix:GROUP, local, spiffe://LAB/hapticd/ROLE/NAME, serial:NUMBER"},
          {"[access.denied]\n\"user:\" = \"left\"\n", "'access.denied.user:'", kMalformed, 2},
          {"[access.denied]\n\"serial:8AG4\" = \"lost\"\n", "'access.denied.serial:8AG4'", kMalformed, 2,
           "hexadecimal"},
          {"[access.denied]\n\"serial:\" = \"lost\"\n", "'access.denied.serial:'", kMalformed, 2},
          {"[access.denied]\n\"8AD4\" = \"lost\"\n", "'access.denied.8AD4'", kMalformed, 2, "serial:NUMBER"},
          {"[network]\nlisten = \"0.0.0.0:50051\"\n", "beyond this machine", kOutOfRange, 2},
      },
      read_configuration);
}

TEST(Configuration, ASimulationWithATimeOfItsOwnKeepsItInTheFile) {
  const auto config = test::value_of(parse_config("[rig.sim]\nspeed = 20\n", "hapticd.toml"));
  EXPECT_FALSE(config.simulation.real_time);
  EXPECT_EQ(config.simulation.speed, 20.0);
  const auto again = test::value_of(parse_config(write_config(config), "hapticd.toml"));
  EXPECT_FALSE(again.simulation.real_time);
  EXPECT_EQ(again.simulation.speed, 20.0);
  EXPECT_TRUE(parse_config("[rig.sim]\nspeed = 1\n", "hapticd.toml")->simulation.real_time);
}

TEST(Configuration, AFileThatIsNotThereIsRefused) {
  using enum hal::ErrorCode;
  test::expect_refusals({{"/nowhere/hapticd.toml", "/nowhere/hapticd.toml", kNotFound}}, read_config);
  const test::TemporaryFolder folder;
  test::expect_refusals({{folder.path(), folder.path(), kUnreadable}}, read_config);
}

TEST(Configuration, ListensOnLoopbackOnly) {
  using enum hal::ErrorCode;
  for (const char* address : {"127.0.0.1:50051", "127.1.2.3:0", "localhost:80", "[::1]:443"}) {
    const auto parsed = test::value_of(parse_listen_address(address, "--listen"));
    EXPECT_EQ(parsed.text(), address);
  }
  std::vector<test::RefusedText> refused{{"lab.example.org:50051", "--listen", kOutOfRange},
                                         {":1", "--listen", kOutOfRange}};
  for (const char* address : {"0.0.0.0:50051", "192.168.1.7:50051", "[::]:50051", "128.0.0.1:1"}) {
    refused.push_back({address, "--listen", kOutOfRange});
  }
  for (const char* address :
       {"127.0.0.1", "127.0.0.1:", "127.0.0.1:70000", "127.0.0.1:5x", "::1:50051", ""}) {
    refused.push_back({address, "--listen", kMalformed});
  }
  test::expect_refusals(refused,
                        [](const std::string& text) { return parse_listen_address(text, "--listen"); });
}

TEST(Configuration, ListensElsewhereWithCertificatesOnly) {
  using enum hal::ErrorCode;
  for (const char* address : {"192.168.1.7:50051", "[fd00::20]:50051", "0.0.0.0:50052", "127.0.0.1:50052"}) {
    const auto parsed = test::value_of(parse_tls_address(address, "--listen-tls"));
    EXPECT_EQ(parsed.text(), address);
  }
  EXPECT_FALSE(parse_tls_address("lab1:50051", "--listen-tls")) << "names may mean another address there";
  ConfigOverrides overrides;
  overrides.listen_tls = "192.168.1.7:50051";
  const hal::Error plain = test::error_of(override_config(DaemonConfig{}, overrides));
  EXPECT_EQ(plain.code, kMissingKey);
  EXPECT_EQ(plain.where, "[network] certificates");
  overrides.certificates = "/etc/hapticd/certificates";
  EXPECT_TRUE(override_config(DaemonConfig{}, overrides));
  overrides.listen_tls = "0.0.0.0:50051";
  const auto same_port = override_config(DaemonConfig{}, overrides);
  ASSERT_FALSE(same_port) << "the port of loopback";
  EXPECT_EQ(same_port.error().code, kContradiction);
  for (const char* neighbour : {"0.0.0.0:50052", "127.0.0.1:50052", "127.0.0.1:50050"}) {
    overrides.listen_tls = neighbour;
    EXPECT_FALSE(override_config(DaemonConfig{}, overrides)) << "stops come by the next port";
  }
  overrides.listen_tls = "192.168.1.7:65535";
  EXPECT_FALSE(override_config(DaemonConfig{}, overrides)) << "there is no next one";
}

TEST(Configuration, KeysOfTheConsoleThatMovedAreRefusedWithTheirPlace) {
  for (const char* key : {"listen = \"127.0.0.1:50080\"", "listen_tls = \"\"", "names = \"rig\"",
                          "max_sockets = 10", "max_requests_per_s = 100", "session_h = 8"}) {
    const auto config = read_configuration(std::string("[console]\n") + key);
    ASSERT_FALSE(config) << key;
    EXPECT_EQ(config.error().code, hal::ErrorCode::kMisplacedKey);
    EXPECT_NE(config.error().remedy.find("/etc/hapticd/console.toml"), std::string::npos);
    EXPECT_NE(config.error().where.find("line 2"), std::string::npos) << config.error().where;
  }
  EXPECT_EQ(read_configuration("[console]\nuser = \"page\"")->console.user, "page");
}

TEST(Configuration, AccessHasRolesByName) {
  const auto config = test::value_of(parse_config(
      "[access]\nlease = \"required\"\nlocal_role = \"observer\"\n[access.users]\nanna = \"operator\"\n"
      "[access.certificates]\n\"spiffe://lab/hapticd/observer/ben\" = \"maintainer\"\n"
      "[access.denied]\n\"serial:0A1B\" = \"laptop lost\"\n",
      "hapticd.toml"));
  EXPECT_EQ(config.access.lease, LeaseRule::kRequired);
  EXPECT_EQ(config.access.local_role, Role::kObserver);
  EXPECT_EQ(config.access.users.at("anna"), Role::kOperator);
  EXPECT_EQ(config.access.certificates.at("spiffe://lab/hapticd/observer/ben"), Role::kMaintainer);
  EXPECT_EQ(config.access.denied.at("serial:0A1B"), "laptop lost");
  const auto again = test::value_of(parse_config(write_config(config), "again"));
  EXPECT_EQ(again.access.users, config.access.users);
  EXPECT_EQ(again.access.denied, config.access.denied);
}

TEST(Configuration, ANumberOfACertificateIsDeniedInEverySpelling) {
  for (const char* key : {"serial:0AD4F1", "serial:ad4f1", "serial=0AD4F1", "serial:0A:D4:F1",
                          "serial:00:0a:d4:f1", "serial:0xad4f1"}) {
    const auto config =
        test::value_of(read_configuration(std::string("[access.denied]\n\"") + key + "\" = \"lost\"\n"));
    EXPECT_EQ(config.access.denied.size(), 1U) << key;
    EXPECT_TRUE(config.access.denied.contains("serial:0AD4F1")) << key;
  }
  const auto others = test::value_of(read_configuration(
      "[access.denied]\n\"user:ben\" = \"left\"\n\"unix:students\" = \"left\"\nlocal = \"no\"\n"
      "\"spiffe://lab/hapticd/observer/ben\" = \"left\"\n"));
  EXPECT_EQ(others.access.denied.size(), 4U);
}

TEST(Configuration, ASimulatedRigIsPutUnderTheConditionsOfALabByName) {
  using enum hal::ErrorCode;
  for (const auto& [text, device, conditions] :
       {std::array{"sim", "phantom_1_0", "clean"}, std::array{"sim:lab", "phantom_1_0", "lab"},
        std::array{"sim:phantom_1_5_high_force", "phantom_1_5_high_force", "clean"},
        std::array{"sim:phantom_1_5_high_force:lab", "phantom_1_5_high_force", "lab"}}) {
    DaemonConfig config;
    ASSERT_FALSE(apply_rig_text(text, config)) << text;
    EXPECT_EQ(config.simulation.device, device) << text;
    EXPECT_EQ(config.simulation.conditions, conditions) << text;
  }
  const auto file =
      test::value_of(parse_config("[rig.sim]\nobject_edge_mm = 12\nobject_slides_above_n = 0.5\n"
                                  "[rig.sim.conditions]\npreset = \"lab\"\nsensor_drift_n_per_s = 0.002\n",
                                  "hapticd.toml"));
  EXPECT_EQ(file.simulation.conditions, "lab");
  EXPECT_EQ(file.simulation.condition_values.at("sensor_drift_n_per_s"), 0.002);
  EXPECT_EQ(file.simulation.hold.edge_mm, 12.0);
  const auto again = test::value_of(parse_config(write_config(file), "hapticd.toml"));
  EXPECT_EQ(again.simulation.conditions, "lab");
  EXPECT_EQ(again.simulation.condition_values, file.simulation.condition_values);
  EXPECT_EQ(again.simulation.hold.slides_above_n, 0.5);

  DaemonConfig config;
  ASSERT_FALSE(apply_rig_text("sim:phantom_1_0:lap", config));
  const hal::Error refused = test::error_of(open_rig(config));
  EXPECT_EQ(refused.value, "lap");
  EXPECT_EQ(refused.code, kUnknownWord);
}

TEST(Configuration, TheCommandLineGoesBeforeTheFile) {
  const auto file =
      parse_config("[loop]\nrate_hz = 2000\n[rig.sim]\nobject = \"foam_ball\"\n", "hapticd.toml");
  ASSERT_TRUE(file);
  ConfigOverrides overrides;
  overrides.rate_hz = 4000.0;
  overrides.rig = "sim:phantom_1_5_high_force";
  overrides.listen = "localhost:0";
  overrides.log_level = "error";
  const auto config = test::value_of(override_config(*file, overrides));
  EXPECT_EQ(config.loop.rate_hz, 4000.0);
  EXPECT_EQ(config.simulation.rate_hz, 4000.0);
  EXPECT_EQ(config.simulation.device, "phantom_1_5_high_force");
  EXPECT_EQ(config.simulation.object, "foam_ball");
  EXPECT_EQ(config.listen.text(), "localhost:0");
  EXPECT_EQ(config.log_level, LogLevel::kError);
}

TEST(RigText, AReplayCarriesItsColumnMapping) {
  DaemonConfig config;
  const auto error = apply_rig_text(
      "replay:/data/"
      "run.csv?force=load_uN&force_scale=1e6&position=tip_um&position_unit=um&speed=fast&loop=true&"
      "decimal_comma=true",
      config);
  ASSERT_FALSE(error) << error->text();
  EXPECT_EQ(config.rig, RigChoice::kReplay);
  EXPECT_EQ(config.replay.path, "/data/run.csv");
  EXPECT_EQ(config.replay.force.column, "load_uN");
  EXPECT_EQ(config.replay.force.scale, 1e6);
  EXPECT_EQ(config.replay.position.column, "tip_um");
  EXPECT_EQ(config.replay.position.unit, "um");
  EXPECT_TRUE(config.replay.as_fast_as_possible);
  EXPECT_TRUE(config.replay.loop);
  EXPECT_TRUE(config.replay.decimal_comma);
}

TEST(RigText, ASimulatedRigCarriesItsPlant) {
  for (const char* text : {"sim:phantom_1_5_high_force:general", "sim:general:phantom_1_5_high_force"}) {
    DaemonConfig config;
    const auto error = apply_rig_text(text, config);
    ASSERT_FALSE(error) << error->text();
    EXPECT_EQ(config.simulation.device, "phantom_1_5_high_force");
    EXPECT_EQ(config.simulation.plant, "general");
    EXPECT_EQ(config.simulation.conditions, "clean");
  }
  DaemonConfig both;
  ASSERT_FALSE(apply_rig_text("sim:phantom_1_0:lab:general", both));
  EXPECT_EQ(both.simulation.conditions, "lab");
  EXPECT_EQ(both.simulation.plant, "general");
}

/// The rig that a file describes, as far as possible without touching hardware.
hal::Result<std::unique_ptr<hal::Rig>> rig_of(const std::string& text) {
  auto config = parse_config(text, "rig.toml");
  if (config) config = override_config(*config, {});
  if (!config) return config.error();
  return open_rig(*config);
}

TEST(RigNames, OfASimulatedRigAreSuggested) {
  using enum hal::ErrorCode;
  const auto device = rig_of("[rig.sim]\ndevice = \"phantom_1.0\"\n");
  ASSERT_FALSE(device);
  EXPECT_EQ(device.error().remedy, "did you mean 'phantom_1_0'?");
  test::expect_refusals(
      {
          {"[rig.sim]\ndevice = \"phantom_1.0\"\n", "[rig.sim] device", kUnknownWord},
          {"[rig.sim]\nobject = \"spnge_block\"\n", "[rig.sim] object", kUnknownWord},
          {"[rig.sim]\ntip = \"bal_bearing\"\n", "[rig.sim] tip", kUnknownWord},
      },
      rig_of);
  const std::string station = "[rig.turntable.stations.a]\nangle_deg = 0\nobject = ";
  const auto object = rig_of(station + "\"sponge\"\n");
  ASSERT_FALSE(object);
  EXPECT_EQ(object.error().where, "[rig.turntable.stations.a] object");
  EXPECT_EQ(object.error().remedy, "did you mean 'sponge_block'?");
  for (const char* known : {"\"sponge_block\"\n", "\"none\"\n", "\"\"\n"})
    EXPECT_TRUE(rig_of(station + known));
  const std::string real = "[rig]\nkind = \"hardware\"\nsensor = \"netft\"\n";
  EXPECT_TRUE(rig_of(real + station + "\"my sponge\"\n")) << "a real rig's objects have any name";
}

TEST(RigText, MistakesAreNamed) {
  using enum hal::ErrorCode;
  test::expect_refusals(
      {
          {"replay:run.csv?forse=load_uN", "'forse'", kUnknownKey},
          {"replay:run.csv?speed=warp", "'warp'", kUnknownWord},
          {"replay:run.csv?force", "has no value", kMalformed},
          {"replay:run.csv?force_scale=ten", "'force_scale'", kWrongType},
          {"phantom", "'phantom'", kUnknownWord},
          {"hardware:netft", "--rig", kMalformed},
          {"replay", "[rig.replay] path", kMissingKey},
      },
      [](const std::string& text) {
        ConfigOverrides overrides;
        overrides.rig = text;
        return override_config({}, overrides);
      });
}

TEST(RigFile, MixesRealSimulatedAndReplayedParts) {
  struct Case {
    const char* text;
    const char* name;
  };
  for (const Case& mix : {
           Case{"[rig]\nsensor = \"netft\"", "netft + sim:phantom_1_0"},
           Case{"[rig]\ndevice = \"openhaptics\"", "openhaptics + sim:phantom_1_0"},
           Case{"[rig]\nkind = \"hardware\"\ndevice = \"openhaptics\"\nsensor = \"netft\"",
                "openhaptics + netft"},
           Case{"[rig]\nkind = \"hardware\"\nsensor = \"netft\"", "netft"},
       }) {
    const auto rig = rig_of(mix.text);
    ASSERT_TRUE(rig) << mix.text << ": " << rig.error().text();
    EXPECT_EQ((*rig)->info().name, mix.name);
    EXPECT_EQ((*rig)->info().kind, hal::RigKind::kHardware);
    for (const hal::PartReport& report : (*rig)->reports()) {
      EXPECT_EQ(report.state, hal::PartState::kIdle) << "nothing is opened by describing it";
    }
  }
}

TEST(RigFile, ReplaysARecordingBesideARealDevice) {
  using enum hal::ErrorCode;
  const test::TemporaryFolder folder;
  const std::string path =
      folder.write("run.csv", "time_s,force_N,indentation_mm\n0,0,0\n0.001,0.1,0.01\n0.002,0.2,0.02\n");
  const std::string text =
      "[rig]\nkind = \"replay\"\ndevice = \"openhaptics\"\n[rig.replay]\npath = \"" + path + "\"\n";
  const auto rig = test::value_of(rig_of(text));
  EXPECT_EQ(rig->info().name.find("openhaptics + replay"), 0U) << rig->info().name;
  test::expect_refusals({{text + "speed = \"fast\"\n", "[rig.replay] speed", kContradiction}}, rig_of);
}

TEST(RigFile, RefusesWhatCannotBe) {
  using enum hal::ErrorCode;
  test::expect_refusals(
      {
          {"[rig]\nkind = \"hardware\"", "[rig] device, sensor", kMissingKey},
          {"[rig]\nsensor = \"netft\"\n[rig.sim]\nspeed = 20", "[rig.sim] speed", kContradiction},
          {"[rig]\nsensor = \"netft\"\n[rig.netft]\naxes = \"+x +y -z\"", "[rig.netft] axes", kMalformed},
      },
      rig_of);
  const hal::Error refused = test::error_of(rig_of("[rig]\nsensor = \"daq\""));
  if (daq::has_comedi()) {
    EXPECT_EQ(refused.what, "no calibration file");
  }
}

}  // namespace
}  // namespace hapticd::server
