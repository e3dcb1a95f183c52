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
#include "server/text/toml_text.h"

namespace hapticd::server {

namespace {

std::string write_guard(const GuardCeilings& guard) {
  const auto number = [](double value) { return toml_number(value); };
  return fmt::format(
      "\n[guard]\nmax_force_n = {}\nmax_force_rate_n_per_s = {}\nmax_power_w = {}\n"
      "max_target_stiffness_n_per_mm = {}\nmax_wall_stiffness_n_per_mm = {}\nmin_target_ramp_s = {}\n"
      "max_target_change_n_per_s = {}\nmin_resume_ramp_s = {}\nmax_fall_ramp_s = {}\n"
      "max_sensor_stale_after_ms = {}\nmax_loop_gap_ms = {}\n",
      number(guard.max_force_n), number(guard.max_force_rate_n_per_s), number(guard.max_power_w),
      number(guard.max_target_stiffness_n_per_mm), number(guard.max_wall_stiffness_n_per_mm),
      number(guard.min_target_ramp_s), number(guard.max_target_change_n_per_s),
      number(guard.min_resume_ramp_s), number(guard.max_fall_ramp_s), number(guard.max_sensor_stale_after_ms),
      number(guard.max_loop_gap_ms));
}

std::string write_mapping(std::string_view name, const replay::ColumnMapping& mapping) {
  return fmt::format("\n[rig.replay.{}]\ncolumn = {}\nunit = {}\nscale = {}\n", name,
                     toml_quoted(mapping.column), toml_quoted(mapping.unit), toml_number(mapping.scale));
}

}  // namespace

std::string write_config(const DaemonConfig& config) {
  std::string text = fmt::format(
      "[loop]\nrate_hz = {}\nfifo_priority = {}\ncpu = {}\nwake_early_share = {}\nlock_memory = "
      "{}\nkeep_cpu_awake = {}\n",
      toml_number(config.loop.rate_hz), config.loop.fifo_priority, config.loop.cpu,
      toml_number(config.loop.wake_early_share), config.loop.lock_memory, config.loop.keep_cpu_awake);
  text += fmt::format("\n[network]\nlisten = {}\nunix_socket = {}\nlisten_tls = {}\ncertificates = {}\n",
                      toml_quoted(config.listen.text()), toml_quoted(config.unix_socket),
                      toml_quoted(config.listen_tls ? config.listen_tls->text() : std::string()),
                      toml_quoted(config.certificates));
  text += fmt::format("\n[rig]\nkind = {}\ndevice = {}\nsensor = {}\ninstrument = {}\n",
                      toml_quoted(text_of(config.rig, kRigWords)),
                      toml_quoted(text_of(config.device, kDeviceWords)),
                      toml_quoted(text_of(config.sensor, kSensorWords)),
                      toml_quoted(text_of(config.instrument, kInstrumentWords)));
  text += write_simulation(config.simulation);
  const replay::ReplayConfig& replay = config.replay;
  text += fmt::format("\n[rig.replay]\npath = {}\nspeed = {}\nloop = {}\nbias_s = {}\ndecimal_comma = {}\n",
                      toml_quoted(replay.path), toml_quoted(text_of(replay.as_fast_as_possible, kSpeedWords)),
                      replay.loop, toml_number(replay.bias_s), replay.decimal_comma);
  text += write_mapping("time", replay.time) + write_mapping("force", replay.force) +
          write_mapping("position", replay.position);
  text += "\n[rig.openhaptics]\n" + write_openhaptics(config.openhaptics);
  text += "\n[rig.phantom]\n" + write_phantom(config.phantom);
  text += "\n[rig.netft]\n" + write_netft(config.netft);
  text += "\n[rig.daq]\n" + write_daq(config.daq);
  text += "\n[rig.board]\n" + write_board(config.board);
  text += "\n[rig.board_instrument]\n" + write_instrument(config.board_instrument);
  text += write_turntable(config.turntable);
  text += write_guard(config.guard);
  text += fmt::format("\n[scene]\nload = {}\nfolder = {}\n", toml_quoted(config.scene),
                      toml_quoted(config.scene_folder));
  text += fmt::format("\n[models]\nfolder = {}\nstore = {}\n", toml_quoted(config.model_folder),
                      toml_quoted(config.model_store.value_or("")));
  text += write_access(config.access);
  text += write_watchdog(config.watchdog);
  text += write_metrics(config.metrics);
  text += write_console(config.console);
  text += write_recording(config.recording);
  text += fmt::format("\n[log]\nlevel = {}\n", toml_quoted(text_of(config.log_level, kLogWords)));
  return text;
}

}  // namespace hapticd::server
