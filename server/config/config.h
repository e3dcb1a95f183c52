#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "hal/daq/board_config.h"
#include "hal/daq/board_instrument.h"
#include "hal/daq/daq_sensor.h"
#include "hal/error.h"
#include "hal/netft/netft_config.h"
#include "hal/openhaptics/openhaptics_config.h"
#include "hal/phantom/phantom_config.h"
#include "hal/replay/replay_rig.h"
#include "hal/sim/simulated_rig.h"
#include "rt/loop/periodic_loop.h"
#include "server/config/access_config.h"
#include "server/config/console_section.h"
#include "server/config/guard_ceilings.h"
#include "server/config/listen_address.h"
#include "server/config/metrics_section.h"
#include "server/config/recording_section.h"
#include "server/config/watchdog_config.h"
#include "server/process/log_level.h"
#include "server/rig_file/turntable_config.h"

namespace hapticd::server {

/// What replaces the parts of the rig that are not named; kHardware: nothing.
enum class RigChoice : std::uint8_t { kSimulated, kReplay, kHardware };
enum class DeviceChoice : std::uint8_t { kOfKind, kOpenHaptics, kPhantom };
enum class SensorChoice : std::uint8_t { kOfKind, kNetFt, kDaq };
enum class InstrumentChoice : std::uint8_t { kNone, kBoard };

/// Everything the daemon can be reported before it starts. The defaults are here and nowhere else.
struct DaemonConfig {
  rt::LoopConfig loop;  ///< [loop]; its rate is the rig's too

  ListenAddress listen;     ///< [network] listen
  std::string unix_socket;  ///< [network] unix_socket; empty = none
  /// [network] listen_tls, for connections with certificates; absent = none.
  std::optional<ListenAddress> listen_tls;
  std::string certificates;  ///< [network] certificates: folder of server.crt, server.key, authority.crt

  RigChoice rig = RigChoice::kSimulated;                  ///< [rig] kind
  DeviceChoice device = DeviceChoice::kOfKind;            ///< [rig] device
  SensorChoice sensor = SensorChoice::kOfKind;            ///< [rig] sensor
  InstrumentChoice instrument = InstrumentChoice::kNone;  ///< [rig] instrument
  sim::SimulationConfig simulation;                       ///< [rig.sim]; always paced in real time here
  replay::ReplayConfig replay;  ///< [rig.replay]; at recorded speed unless set otherwise

  openhaptics::OpenHapticsConfig openhaptics;   ///< [rig.openhaptics]
  phantom::PhantomConfig phantom;               ///< [rig.phantom]; on the board
  netft::NetFtConfig netft;                     ///< [rig.netft]
  daq::DaqSensorConfig daq;                     ///< [rig.daq]; on the board
  daq::BoardConfig board;                       ///< [rig.board]; sensor and device may share it
  daq::BoardInstrumentConfig board_instrument;  ///< [rig.board_instrument]; on the board

  TurntableConfig turntable;  ///< [rig.turntable]

  std::string scene;         ///< [scene] load; empty = none
  std::string scene_folder;  ///< [scene] folder; empty = built-in scenes only
  std::string model_folder;  ///< [models] folder; empty = built-in models of objects only
  /// [models] store; empty or ":memory:" = in memory. Absent: in memory too, but hapticd itself
  /// uses default_model_store().
  std::optional<std::string> model_store;

  GuardCeilings guard;  ///< [guard]

  AccessConfig access;  ///< [access]

  WatchdogConfig watchdog;  ///< [watchdog]
  MetricsConfig metrics;    ///< [metrics]
  ConsoleConfig console;    ///< [console]

  RecordingConfig recording;  ///< [recording]

  LogLevel log_level = LogLevel::kInfo;  ///< [log] level

  /// Folder in which the daemon marks that it runs: after a crash it then starts without force. Empty:
  /// nowhere. No key: hapticd itself takes the folder that systemd gives to a service.
  std::string state_folder;

  DaemonConfig() {
    simulation.real_time = true;
    replay.as_fast_as_possible = false;
  }
};

/// What the command line may override; absent = as in the file, or the default.
struct ConfigOverrides {
  std::optional<std::string> rig;  ///< sim, sim:PRESET[:lab], replay:PATH[?key=value&…]
  std::optional<std::string> listen;
  std::optional<std::string> unix_socket;
  std::optional<std::string> listen_tls;
  std::optional<std::string> certificates;
  std::optional<std::string> scene;
  std::optional<std::string> scene_folder;
  std::optional<std::string> model_folder;
  std::optional<std::string> model_store;
  std::optional<double> rate_hz;
  std::optional<std::string> log_level;
};

/// Reads a configuration file. Unknown keys are errors, by name and line.
hal::Result<DaemonConfig> read_config(const std::string& path);
/// Parses a configuration from text; `source` names it in errors.
hal::Result<DaemonConfig> parse_config(std::string_view text, std::string source);
/// Puts the command line before the file, and the file before the defaults; then all values are checked
/// together.
hal::Result<DaemonConfig> override_config(DaemonConfig config, const ConfigOverrides& overrides);
/// Writes the whole configuration as TOML, with every default; reads back as the same.
std::string write_config(const DaemonConfig& config);

/// Reads "sim", "sim:PRESET", "sim:PRESET:lab" or "replay:PATH?force=load_uN&position=tip_um&speed=recorded"
/// into `config`.
std::optional<hal::Error> apply_rig_text(std::string_view text, DaemonConfig& config);

}  // namespace hapticd::server
