#include <gtest/gtest.h>

#include <array>

#include "hal/daq/board_factory.h"
#include "server/config/config.h"
#include "server/rig/rig_factory.h"
#include "tests/support/temporary_folder.h"

namespace hapticd::server {
namespace {

void expect_error(const hal::Error& error, const hal::Error& expected) {
  EXPECT_EQ(error.what, expected.what);
  EXPECT_EQ(error.where, expected.where);
  EXPECT_EQ(error.value, expected.value);
  EXPECT_EQ(error.limit, expected.limit);
  EXPECT_EQ(error.remedy, expected.remedy);
}

void expect_config_refused(const std::string& text, const hal::Error& expected) {
  const auto config = parse_config(text, "hapticd.toml");
  ASSERT_FALSE(config) << text;
  expect_error(config.error(), expected);
}

TEST(Configuration, AnEmptyFileMeansTheDefaults) {
  const auto config = parse_config("", "hapticd.toml");
  ASSERT_TRUE(config) << config.error().text();
  EXPECT_EQ(config->listen.text(), "127.0.0.1:50051");
  EXPECT_EQ(config->loop.rate_hz, 1000.0);
  EXPECT_EQ(config->rig, RigChoice::kSimulated);
  EXPECT_TRUE(config->simulation.real_time);
  EXPECT_FALSE(config->replay.as_fast_as_possible);
}

TEST(Configuration, WhatIsWrittenReadsBackAsTheSame) {
  const auto config = parse_config(R"(
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
                                   "hapticd.toml");
  ASSERT_TRUE(config) << config.error().text();
  const std::string text = write_config(*config);
  const auto again = parse_config(text, "written");
  ASSERT_TRUE(again) << again.error().text() << "\n" << text;
  EXPECT_EQ(write_config(*again), text);
  EXPECT_EQ(again->loop.rate_hz, 2500.0);
  EXPECT_EQ(again->loop.wake_early_share, 0.25);
  EXPECT_EQ(again->listen.text(), "[::1]:7");
  EXPECT_EQ(again->unix_socket, "/run/hapticd/a \"strange\" one.sock");
  EXPECT_EQ(again->simulation.structural_mode_hz, 123.5);
  EXPECT_TRUE(again->replay.as_fast_as_possible);
  EXPECT_EQ(again->replay.force.scale, 1e-3);
  EXPECT_EQ(again->simulation.tip, "ball_bearing");
  EXPECT_EQ(again->simulation.plant, "general");
  EXPECT_EQ(again->model_folder, "/etc/hapticd/models");
  EXPECT_EQ(again->model_store, "/var/lib/hapticd/models.sqlite");
  EXPECT_EQ(again->log_level, LogLevel::kDebug);
}

TEST(Configuration, AnUnknownKeyIsRefusedByNameLineAndSuggestion) {
  expect_config_refused("[loop]\nrate_hz = 1000\nfifo_prioity = 3\n",
                        {"unknown key 'fifo_prioity' in [loop]", "hapticd.toml, line 3", "",
                         "rate_hz, fifo_priority, cpu, wake_early_share, lock_memory, keep_cpu_awake",
                         "did you mean 'fifo_priority'?"});
  expect_config_refused(
      "[lop]\nrate_hz = 1000\n",
      {"unknown key 'lop'", "hapticd.toml, line 1", "",
       "loop, network, rig, guard, access, watchdog, scene, models, recording, metrics, console, log",
       "did you mean 'loop'?"});
  expect_config_refused(
      "[rig.sim]\nforce = 3\n",
      {"unknown key 'force' in [rig.sim]", "hapticd.toml, line 2", "",
       "device, object, tip, plant, seed, speed, structural_mode_hz, structural_damping, amplifier_pole_hz, "
       "tool_mass_g, object_edge_mm, object_slides_above_n, conditions",
       "remove it"});
}

TEST(Configuration, ASimulationWithATimeOfItsOwnKeepsItInTheFile) {
  const auto config = parse_config("[rig.sim]\nspeed = 20\n", "hapticd.toml");
  ASSERT_TRUE(config);
  EXPECT_FALSE(config->simulation.real_time);
  EXPECT_EQ(config->simulation.speed, 20.0);
  const auto again = parse_config(write_config(*config), "hapticd.toml");
  ASSERT_TRUE(again);
  EXPECT_FALSE(again->simulation.real_time);
  EXPECT_EQ(again->simulation.speed, 20.0);
  EXPECT_TRUE(parse_config("[rig.sim]\nspeed = 1\n", "hapticd.toml")->simulation.real_time);
}

TEST(Configuration, EveryValueHasATypeARangeAndAUnit) {
  expect_config_refused("[loop]\nrate_hz = 99000\n",
                        {"'loop.rate_hz' is out of range", "hapticd.toml, line 2", "99000 Hz",
                         "500 … 10000 Hz", "use at most 10000 Hz"});
  expect_config_refused("[loop]\nrate_hz = nan\n", {"'loop.rate_hz' is not finite", "hapticd.toml, line 2",
                                                    "nan", "500 … 10000 Hz", "send a finite number"});
  expect_config_refused("[rig.sim]\ntool_mass_g = -1.5\n",
                        {"'rig.sim.tool_mass_g' is out of range", "hapticd.toml, line 2", "-1.5 g",
                         "0 … 500 g", "use at least 0 g"});
  expect_config_refused("[loop]\nrate_hz = \"fast\"\n",
                        {"'loop.rate_hz' has the wrong type", "hapticd.toml, line 2", "a string",
                         "a number, 500 … 10000 Hz", "correct the value"});
  expect_config_refused("[loop]\ncpu = 1.5\n",
                        {"'loop.cpu' has the wrong type", "hapticd.toml, line 2", "a number",
                         "a whole number, -1 … 1023", "correct the value"});
  expect_config_refused("loop = 3\n", {"'loop' has the wrong type", "hapticd.toml, line 1", "an integer",
                                       "a table [loop]", "correct the value"});
  expect_config_refused("[rig]\nkind = \"simm\"\n",
                        {"'rig.kind' is none of the words it may be", "hapticd.toml, line 2", "simm",
                         "sim, replay, hardware", "did you mean 'sim'?"});
}

TEST(Configuration, TheFirstOfSeveralMistakesIsReported) {
  expect_config_refused("[loop]\nrat_hz = 1\n[rig.sim]\ntool_mass_g = -1\n",
                        {"unknown key 'rat_hz' in [loop]", "hapticd.toml, line 2", "",
                         "rate_hz, fifo_priority, cpu, wake_early_share, lock_memory, keep_cpu_awake",
                         "did you mean 'rate_hz'?"});
}

TEST(Configuration, BrokenTomlIsRefusedWithItsPlace) {
  const auto config = parse_config("[loop]\nrate_hz = = 3\n", "hapticd.toml");
  ASSERT_FALSE(config);
  EXPECT_EQ(config.error().where, "hapticd.toml, line 2, column 11");
  EXPECT_EQ(config.error().what.rfind("not valid TOML", 0), 0U) << config.error().what;
}

TEST(Configuration, AFileThatIsNotThereIsRefused) {
  const auto config = read_config("/nowhere/hapticd.toml");
  ASSERT_FALSE(config);
  expect_error(config.error(), {"cannot read the file", "/nowhere/hapticd.toml", "No such file or directory",
                                "", "check path and permissions"});
}

TEST(Configuration, ListensOnLoopbackOnly) {
  for (const char* address : {"127.0.0.1:50051", "127.1.2.3:0", "localhost:80", "[::1]:443"}) {
    const auto parsed = parse_listen_address(address, "--listen");
    ASSERT_TRUE(parsed) << parsed.error().text();
    EXPECT_EQ(parsed->text(), address);
  }
  const std::string beyond =
      "refusing to listen beyond this machine: the connection is neither encrypted nor authenticated";
  const std::string remedy =
      "listen there with certificates (--listen-tls, deploy/make_certificates.sh), or on 127.0.0.1 and reach "
      "it "
      "through an SSH tunnel";
  for (const char* address : {"0.0.0.0:50051", "192.168.1.7:50051", "[::]:50051", "128.0.0.1:1"}) {
    const auto parsed = parse_listen_address(address, "--listen");
    ASSERT_FALSE(parsed) << address;
    expect_error(parsed.error(), {beyond, "--listen", address, "127.0.0.0/8, ::1, localhost", remedy});
  }
  const auto named = parse_listen_address("lab.example.org:50051", "--listen");
  ASSERT_FALSE(named);
  EXPECT_EQ(named.error().what,
            "refusing to listen on a host that is not known to be this machine's loopback");
  for (const char* address :
       {"127.0.0.1", "127.0.0.1:", "127.0.0.1:70000", "127.0.0.1:5x", "::1:50051", ":1", ""}) {
    EXPECT_FALSE(parse_listen_address(address, "--listen")) << address;
  }
}

TEST(Configuration, TheFileNamesTheLineOfARefusedAddress) {
  expect_config_refused(
      "[network]\nlisten = \"0.0.0.0:50051\"\n",
      {"refusing to listen beyond this machine: the connection is neither encrypted nor "
       "authenticated",
       "hapticd.toml, line 2", "0.0.0.0:50051", "127.0.0.0/8, ::1, localhost",
       "listen there with certificates (--listen-tls, deploy/make_certificates.sh), or on 127.0.0.1 and "
       "reach it through an SSH tunnel"});
}

TEST(Configuration, ListensElsewhereWithCertificatesOnly) {
  for (const char* address : {"192.168.1.7:50051", "[fd00::20]:50051", "0.0.0.0:50052", "127.0.0.1:50052"}) {
    const auto parsed = parse_tls_address(address, "--listen-tls");
    ASSERT_TRUE(parsed) << parsed.error().text();
    EXPECT_EQ(parsed->text(), address);
  }
  EXPECT_FALSE(parse_tls_address("lab1:50051", "--listen-tls")) << "names may mean another address there";
  ConfigOverrides overrides;
  overrides.listen_tls = "192.168.1.7:50051";
  const auto plain = override_config(DaemonConfig{}, overrides);
  ASSERT_FALSE(plain);
  EXPECT_EQ(plain.error().what, "refusing to listen beyond this machine without certificates");
  overrides.certificates = "/etc/hapticd/certificates";
  EXPECT_TRUE(override_config(DaemonConfig{}, overrides));
  overrides.listen_tls = "0.0.0.0:50051";
  EXPECT_FALSE(override_config(DaemonConfig{}, overrides)) << "the port of loopback";
}

TEST(Configuration, AccessHasRolesByName) {
  const auto config = parse_config(
      "[access]\nlease = \"required\"\nlocal_role = \"observer\"\n[access.users]\nanna = \"operator\"\n"
      "[access.certificates]\n\"spiffe://lab/hapticd/observer/ben\" = \"maintainer\"\n"
      "[access.denied]\n\"serial:0A1B\" = \"laptop lost\"\n",
      "hapticd.toml");
  ASSERT_TRUE(config) << config.error().text();
  EXPECT_EQ(config->access.lease, LeaseRule::kRequired);
  EXPECT_EQ(config->access.local_role, Role::kObserver);
  EXPECT_EQ(config->access.users.at("anna"), Role::kOperator);
  EXPECT_EQ(config->access.certificates.at("spiffe://lab/hapticd/observer/ben"), Role::kMaintainer);
  EXPECT_EQ(config->access.denied.at("serial:0A1B"), "laptop lost");
  const auto again = parse_config(write_config(*config), "again");
  ASSERT_TRUE(again) << again.error().text();
  EXPECT_EQ(again->access.users, config->access.users);
  EXPECT_EQ(again->access.denied, config->access.denied);
  EXPECT_FALSE(parse_config("[access.users]\nanna = \"root\"\n", "hapticd.toml"));
}

TEST(Configuration, ASimulatedRigIsPutUnderTheConditionsOfALabByName) {
  for (const auto& [text, device, conditions] :
       {std::array{"sim", "phantom_1_0", "clean"}, std::array{"sim:lab", "phantom_1_0", "lab"},
        std::array{"sim:phantom_1_5_high_force", "phantom_1_5_high_force", "clean"},
        std::array{"sim:phantom_1_5_high_force:lab", "phantom_1_5_high_force", "lab"}}) {
    DaemonConfig config;
    ASSERT_FALSE(apply_rig_text(text, config)) << text;
    EXPECT_EQ(config.simulation.device, device) << text;
    EXPECT_EQ(config.simulation.conditions, conditions) << text;
  }
  const auto file = parse_config(
      "[rig.sim]\nobject_edge_mm = 12\nobject_slides_above_n = 0.5\n"
      "[rig.sim.conditions]\npreset = \"lab\"\nsensor_drift_n_per_s = 0.002\n",
      "hapticd.toml");
  ASSERT_TRUE(file) << file.error().text();
  EXPECT_EQ(file->simulation.conditions, "lab");
  EXPECT_EQ(file->simulation.condition_values.at("sensor_drift_n_per_s"), 0.002);
  EXPECT_EQ(file->simulation.hold.edge_mm, 12.0);
  const auto again = parse_config(write_config(*file), "hapticd.toml");
  ASSERT_TRUE(again) << again.error().text();
  EXPECT_EQ(again->simulation.conditions, "lab");
  EXPECT_EQ(again->simulation.condition_values, file->simulation.condition_values);
  EXPECT_EQ(again->simulation.hold.slides_above_n, 0.5);

  expect_config_refused("[rig.sim.conditions]\nsensor_drift_n_per_s = 5\n",
                        {"'rig.sim.conditions.sensor_drift_n_per_s' is out of range", "hapticd.toml, line 2",
                         "5 N/s", "0 … 0.01 N/s", "use at most 0.01 N/s"});
  DaemonConfig config;
  ASSERT_FALSE(apply_rig_text("sim:phantom_1_0:lap", config));
  const auto refused = open_rig(config);
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().value, "lap");
  EXPECT_NE(refused.error().remedy.find("lab"), std::string::npos);
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
  const auto config = override_config(*file, overrides);
  ASSERT_TRUE(config) << config.error().text();
  EXPECT_EQ(config->loop.rate_hz, 4000.0);
  EXPECT_EQ(config->simulation.rate_hz, 4000.0);
  EXPECT_EQ(config->simulation.device, "phantom_1_5_high_force");
  EXPECT_EQ(config->simulation.object, "foam_ball");
  EXPECT_EQ(config->listen.text(), "localhost:0");
  EXPECT_EQ(config->log_level, LogLevel::kError);
}

TEST(Configuration, TheCommandLineIsCheckedToo) {
  ConfigOverrides overrides;
  overrides.rate_hz = 20000.0;
  const auto config = override_config({}, overrides);
  ASSERT_FALSE(config);
  expect_error(config.error(), {"the loop rate is out of range", "--rate-hz", "20000 Hz", "500 … 10000 Hz",
                                "use at most 10000 Hz"});
}

TEST(RigText, AReplayCarriesItsColumnMapping) {
  DaemonConfig config;
  const auto error = apply_rig_text(
      "replay:/data/"
      "run.csv?force=load_uN&force_scale=1e6&position=tip_um&position_unit=um&speed=fast&loop=true",
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

TEST(RigNames, OfASimulatedRigAreSuggested) {
  const auto refusal = [](const DaemonConfig& config) {
    const auto rig = open_rig(config);
    EXPECT_FALSE(rig);
    return rig ? hal::Error{} : rig.error();
  };
  DaemonConfig device;
  device.simulation.device = "phantom_1.0";
  EXPECT_EQ(refusal(device).what, "unknown device");
  EXPECT_EQ(refusal(device).where, "[rig.sim] device");
  EXPECT_EQ(refusal(device).remedy, "did you mean 'phantom_1_0'?");
  DaemonConfig object;
  object.simulation.object = "spnge_block";
  EXPECT_EQ(refusal(object).where, "[rig.sim] object");
  EXPECT_EQ(refusal(object).remedy, "did you mean 'sponge_block'?");
  DaemonConfig tip;
  tip.simulation.tip = "bal_bearing";
  expect_error(refusal(tip), {"unknown tip", "[rig.sim] tip", "bal_bearing", "rod, ball_bearing",
                              "did you mean 'ball_bearing'?"});
}

TEST(RigText, MistakesAreNamed) {
  DaemonConfig config;
  auto error = apply_rig_text("replay:run.csv?forse=load_uN", config);
  ASSERT_TRUE(error);
  EXPECT_EQ(error->what, "unknown option 'forse' of a replayed rig");
  EXPECT_EQ(error->remedy, "did you mean 'force'?");
  error = apply_rig_text("replay:run.csv?speed=warp", config);
  ASSERT_TRUE(error);
  expect_error(*error, {"unknown speed 'warp'", "--rig", "warp", "recorded, fast", "use one of those"});
  error = apply_rig_text("replay:run.csv?force", config);
  ASSERT_TRUE(error);
  EXPECT_EQ(error->what, "an option of a replayed rig has no value");
  error = apply_rig_text("replay:run.csv?force_scale=ten", config);
  ASSERT_TRUE(error);
  EXPECT_EQ(error->what, "'force_scale' is not a number");
  error = apply_rig_text("phantom", config);
  ASSERT_TRUE(error);
  expect_error(*error, {"unknown kind of rig 'phantom'", "--rig", "phantom",
                        "sim, sim:PRESET, replay:PATH, hardware", "use one of those"});
  error = apply_rig_text("hardware:netft", config);
  ASSERT_TRUE(error);
  EXPECT_EQ(error->what, "hardware takes no more words");
  ConfigOverrides overrides;
  overrides.rig = "replay";
  const auto without_path = override_config({}, overrides);
  ASSERT_FALSE(without_path);
  EXPECT_EQ(without_path.error().what, "a replayed rig needs a recording");
}

/// The rig that a file describes, as far as possible without touching hardware.
hal::Result<std::unique_ptr<hal::Rig>> rig_of(const std::string& text) {
  auto config = parse_config(text, "rig.toml");
  if (config) config = override_config(*config, {});
  if (!config) return config.error();
  return open_rig(*config);
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
  const test::TemporaryFolder folder;
  const std::string path =
      folder.write("run.csv", "time_s,force_N,indentation_mm\n0,0,0\n0.001,0.1,0.01\n0.002,0.2,0.02\n");
  const std::string text =
      "[rig]\nkind = \"replay\"\ndevice = \"openhaptics\"\n[rig.replay]\npath = \"" + path + "\"\n";
  const auto rig = rig_of(text);
  ASSERT_TRUE(rig) << rig.error().text();
  EXPECT_EQ((*rig)->info().name.find("openhaptics + replay"), 0U) << (*rig)->info().name;
  const auto fast = rig_of(text + "speed = \"fast\"\n");
  ASSERT_FALSE(fast);
  EXPECT_EQ(fast.error().what, "a recording next to hardware cannot be played as fast as possible");
}

TEST(RigFile, OfHardwareAloneNamesItsParts) {
  const auto rig = rig_of("[rig]\nkind = \"hardware\"");
  ASSERT_FALSE(rig);
  EXPECT_EQ(rig.error().what, "a rig of hardware alone names no part");
  expect_config_refused("[rig]\ndevice = \"openhaptic\"\n",
                        {"'rig.device' is none of the words it may be", "hapticd.toml, line 2", "openhaptic",
                         "of_kind, openhaptics, phantom", "did you mean 'openhaptics'?"});
}

TEST(RigFile, TellsWhatADriverDoesNotTake) {
  const auto sensor = rig_of("[rig]\nsensor = \"daq\"");
  ASSERT_FALSE(sensor);
  EXPECT_EQ(sensor.error().what, daq::has_comedi() ? "no calibration file" : sensor.error().what);
  const auto axes = rig_of("[rig]\nsensor = \"netft\"\n[rig.netft]\naxes = \"+x +y -z\"");
  ASSERT_FALSE(axes);
  EXPECT_NE(axes.error().text().find("axes"), std::string::npos);
  const auto key = rig_of("[rig.netft]\nadress = \"10.0.0.2\"\n");
  ASSERT_FALSE(key);
  EXPECT_EQ(key.error().remedy, "did you mean 'address'?");
}

}  // namespace
}  // namespace hapticd::server
