#include <fmt/format.h>

#include <string>

#include "server/config/access_section.h"
#include "server/config/config_words.h"
#include "server/config/watchdog_section.h"
#include "server/rig_file/daq_section.h"
#include "server/rig_file/instrument_section.h"
#include "server/rig_file/netft_section.h"
#include "server/rig_file/openhaptics_section.h"
#include "server/rig_file/phantom_section.h"
#include "server/rig_file/sim_section.h"
#include "server/rig_file/turntable_section.h"
#include "server/text/toml_writer.h"

namespace hapticd::server {

namespace {

constexpr Range kFifoPriority{0.0, 99.0, ""};
constexpr Range kCpu{-1.0, 1023.0, ""};
constexpr Range kWakeEarlyShare{0.0, 0.5, ""};

// For [guard]. Zero, if it is allowed, means the device's own.
constexpr Range kCeilingN{0.0, 100.0, "N"};
constexpr Range kCeilingNPerS{0.0, 1e6, "N/s"};
constexpr Range kCeilingW{0.01, 100.0, "W"};
constexpr Range kCeilingStiffness{0.0, 1000.0, "N/mm"};
constexpr Range kFloorS{0.0, 60.0, "s"};
constexpr Range kFallS{0.0, 1.0, "s"};
constexpr Range kTargetChange{1.0, 1e6, "N/s"};
constexpr Range kCheckMs{0.1, 1000.0, "ms"};  // never off

void loop_fields(auto& table, auto& loop) {
  table.field("rate_hz", loop.rate_hz, kLoopRateHz);
  table.field("fifo_priority", loop.fifo_priority, kFifoPriority);
  table.field("cpu", loop.cpu, kCpu);
  table.field("wake_early_share", loop.wake_early_share, kWakeEarlyShare);
  table.field("lock_memory", loop.lock_memory);
  table.field("keep_cpu_awake", loop.keep_cpu_awake);
}

void replay_fields(auto& table, auto& replay) {
  table.field("path", replay.path, 4096);
  table.field("speed", replay.as_fast_as_possible, kSpeedWords);
  table.field("loop", replay.loop);
  table.field("bias_s", replay.bias_s, kReplayBiasS);
  table.field("decimal_comma", replay.decimal_comma);
  const auto mapping = [&table](const char* name, auto& columns) {
    auto inner = table.table(name);
    inner.field("column", columns.column, 256);
    inner.field("unit", columns.unit, 16);
    inner.field("scale", columns.scale, kReplayScale);
  };
  mapping("time", replay.time);
  mapping("force", replay.force);
  mapping("position", replay.position);
}

void guard_fields(auto& table, auto& guard) {
  table.field("max_force_n", guard.max_force_n, kCeilingN);
  table.field("max_force_rate_n_per_s", guard.max_force_rate_n_per_s, kCeilingNPerS);
  table.field("max_power_w", guard.max_power_w, kCeilingW);
  table.field("max_target_stiffness_n_per_mm", guard.max_target_stiffness_n_per_mm, kCeilingStiffness);
  table.field("max_wall_stiffness_n_per_mm", guard.max_wall_stiffness_n_per_mm, kCeilingStiffness);
  table.field("min_target_ramp_s", guard.min_target_ramp_s, kFloorS);
  table.field("max_target_change_n_per_s", guard.max_target_change_n_per_s, kTargetChange);
  table.field("min_resume_ramp_s", guard.min_resume_ramp_s, kFloorS);
  table.field("max_fall_ramp_s", guard.max_fall_ramp_s, kFallS);
  table.field("max_sensor_stale_after_ms", guard.max_sensor_stale_after_ms, kCheckMs);
  table.field("max_loop_gap_ms", guard.max_loop_gap_ms, kCheckMs);
}

}  // namespace

hal::Result<DaemonConfig> read_config(const std::string& path) {
  auto text = read_text_file(path);
  if (!text) return text.error();
  return parse_config(*text, path);
}

hal::Result<DaemonConfig> parse_config(std::string_view text, std::string source) {
  auto document = TomlDocument::parse(text, std::move(source));
  if (!document) return document.error();

  DaemonConfig config;
  std::string listen = config.listen.text();
  TomlTable root = document->root();
  TomlTable loop = root.table("loop");
  loop_fields(loop, config.loop);
  TomlTable network = root.table("network");
  network.read("listen", listen, 256);
  network.read("unix_socket", config.unix_socket, 4096);
  std::string listen_tls;
  network.read("listen_tls", listen_tls, 256);
  network.read("certificates", config.certificates, 4096);
  TomlTable rig = root.table("rig");
  rig.read("kind", config.rig, kRigWords);
  read_simulation(rig.table("sim"), config.simulation);
  TomlTable replay = rig.table("replay");
  replay_fields(replay, config.replay);
  rig.read("device", config.device, kDeviceWords);
  rig.read("sensor", config.sensor, kSensorWords);
  rig.read("instrument", config.instrument, kInstrumentWords);
  read_openhaptics(rig.table("openhaptics"), config.openhaptics);
  read_phantom(rig.table("phantom"), config.phantom);
  read_netft(rig.table("netft"), config.netft);
  read_daq(rig.table("daq"), config.daq);
  read_board(rig.table("board"), config.board);
  read_instrument(rig.table("board_instrument"), config.board_instrument);
  read_turntable(rig.table("turntable"), config.turntable);
  TomlTable guard = root.table("guard");
  guard_fields(guard, config.guard);
  read_access(root.table("access"), config.access);
  read_watchdog(root.table("watchdog"), config.watchdog);
  TomlTable scene = root.table("scene");
  scene.read("load", config.scene, 256);
  scene.read("folder", config.scene_folder, 4096);
  TomlTable models = root.table("models");
  models.read("folder", config.model_folder, 4096);
  if (models.wants("store")) models.read("store", config.model_store.emplace(), 4096);
  read_recording(root.table("recording"), config.recording);
  const auto wrong_metrics = read_metrics(root.table("metrics"), document->source(), config.metrics);
  read_console(root.table("console"), config.console);
  root.table("log").read("level", config.log_level, kLogWords);
  if (auto error = document->error()) return *error;
  if (wrong_metrics) return *wrong_metrics;

  const auto where = [&](const char* key) {
    return network.has(key) ? fmt::format("{}, line {}", document->source(), network.line_of(key))
                            : document->source();
  };
  auto address = parse_listen_address(listen, where("listen"));
  if (!address) return address.error();
  config.listen = *address;
  if (!listen_tls.empty()) {
    auto tls = parse_tls_address(listen_tls, where("listen_tls"));
    if (!tls) return tls.error();
    config.listen_tls = *tls;
  }
  return config;
}

std::string write_config(const DaemonConfig& config) {
  std::string text = "[loop]\n" + toml_fields([&](auto& loop) { loop_fields(loop, config.loop); });
  TomlWriter root(text);
  TomlWriter network = root.table("network");
  network.field("listen", config.listen.text());
  network.field("unix_socket", config.unix_socket);
  network.field("listen_tls", config.listen_tls ? config.listen_tls->text() : std::string());
  network.field("certificates", config.certificates);
  TomlWriter rig = root.table("rig");
  rig.field("kind", config.rig, kRigWords);
  rig.field("device", config.device, kDeviceWords);
  rig.field("sensor", config.sensor, kSensorWords);
  rig.field("instrument", config.instrument, kInstrumentWords);
  text += write_simulation(config.simulation);
  TomlWriter replay = rig.table("replay");
  replay_fields(replay, config.replay);
  text += "\n[rig.openhaptics]\n" + write_openhaptics(config.openhaptics);
  text += "\n[rig.phantom]\n" + write_phantom(config.phantom);
  text += "\n[rig.netft]\n" + write_netft(config.netft);
  text += "\n[rig.daq]\n" + write_daq(config.daq);
  text += "\n[rig.board]\n" + write_board(config.board);
  text += "\n[rig.board_instrument]\n" + write_instrument(config.board_instrument);
  text += write_turntable(config.turntable);
  TomlWriter guard = root.table("guard");
  guard_fields(guard, config.guard);
  TomlWriter scene = root.table("scene");
  scene.field("load", config.scene);
  scene.field("folder", config.scene_folder);
  TomlWriter models = root.table("models");
  models.field("folder", config.model_folder);
  models.field("store", config.model_store.value_or(""));
  text += write_access(config.access);
  text += write_watchdog(config.watchdog);
  text += write_metrics(config.metrics);
  text += write_console(config.console);
  text += write_recording(config.recording);
  root.table("log").field("level", config.log_level, kLogWords);
  return text;
}

}  // namespace hapticd::server
