#include "server/rig_file/turntable_section.h"

#include <fmt/format.h>

#include "server/rig_file/turntable_map.h"
#include "server/text/text_library.h"
#include "server/text/toml_writer.h"

namespace hapticd::server {

namespace {

constexpr Word<TurntableChoice> kKinds[] = {{"none", TurntableChoice::kNone},
                                            {"sim", TurntableChoice::kSimulated},
                                            {"modbus", TurntableChoice::kModbus}};
constexpr Word<modbus::Transport> kTransports[] = {{"tcp", modbus::Transport::kTcp},
                                                   {"rtu", modbus::Transport::kRtu}};
constexpr Word<char> kParities[] = {{"none", 'N'}, {"even", 'E'}, {"odd", 'O'}};

constexpr Range kAngleDeg{-36000.0, 36000.0, "deg"};
constexpr Range kSpeed{0.01, 3600.0, "deg/s"};
constexpr Range kAcceleration{0.1, 100000.0, "deg/s²"};
constexpr Range kToleranceDeg{0.001, 10.0, "deg"};
constexpr Range kSettleS{0.0, 10.0, "s"};
constexpr Range kStallS{0.05, 60.0, "s"};
constexpr Range kMarginS{0.1, 600.0, "s"};
constexpr Range kHomingS{1.0, 3600.0, "s"};
constexpr Range kPollHz{1.0, 200.0, "Hz"};
constexpr Range kStaleS{0.02, 10.0, "s"};
constexpr Range kEngageS{0.1, 60.0, "s"};
constexpr Range kPauseS{0.01, 600.0, "s"};
constexpr Range kForceN{0.0, 50.0, "N"};
constexpr Range kPort{1.0, 65535.0, ""};
constexpr Range kBaud{1200.0, 1000000.0, "Bd"};
constexpr Range kDataBits{7.0, 8.0, ""};
constexpr Range kStopBits{1.0, 2.0, ""};
constexpr Range kUnit{0.0, 255.0, ""};
constexpr Range kTimeoutS{0.01, 10.0, "s"};
constexpr Range kSteps{1.0, 1e9, ""};
constexpr Range kGear{1e-3, 1e5, ""};
constexpr Range kToolMm{-1000.0, 1000.0, "mm"};
constexpr std::size_t kMaxStations = 64;

void station_fields(auto& table, auto& station) {
  table.field("angle_deg", station.angle_deg, kAngleDeg);
  table.field("object", station.object, 64);
  table.field("tool_mm", station.tool_mm, kToolMm);
}

void read_stations(TomlTable table, std::vector<hal::TurntableStation>& stations) {
  const auto names = table.keys();
  if (!names.empty()) stations.clear();
  for (const std::string& name : names) {
    const auto bad_name = check_name("station", name, "");
    if (bad_name || stations.size() >= kMaxStations) {
      table.wants(name);
      table.refuse(name, bad_name ? *bad_name
                                  : hal::Error::of(hal::ErrorCode::kTooLong, "too many stations", "", name,
                                                   fmt::format("at most {}", kMaxStations), "remove some"));
      continue;
    }
    hal::TurntableStation station;
    station.name = name;
    TomlTable inner = table.table(name);
    station_fields(inner, station);
    if (!inner.has("angle_deg")) {
      table.refuse(name, hal::Error::of(hal::ErrorCode::kMissingKey, "the station has no angle", "", name,
                                        "angle_deg = …", "add it"));
    }
    stations.push_back(std::move(station));
  }
}

void drive_fields(auto& table, auto& config) {
  auto& link = config.modbus.link;
  table.field("transport", link.transport, kTransports);
  table.field("host", link.host, 255);
  table.field("port", link.port, kPort);
  table.field("device", link.device, 255);
  table.field("baud", link.baud, kBaud);
  table.field("parity", link.parity, kParities);
  table.field("data_bits", link.data_bits, kDataBits);
  table.field("stop_bits", link.stop_bits, kStopBits);
  table.field("rs485", link.rs485);
  table.field("unit", link.unit, kUnit);
  table.field("response_timeout_s", link.response_timeout_s, kTimeoutS);
  table.field("connect_timeout_s", link.connect_timeout_s, kTimeoutS);
  auto& gear = config.modbus.gear;
  table.field("steps_per_motor_turn", gear.steps_per_motor_turn, kSteps);
  table.field("motor_turns_per_turn", gear.motor_turns_per_turn, kGear);
  table.field("reversed", gear.reversed);
  table.field("zero_deg", gear.zero_deg, kAngleDeg);
}

/// Reads the register map of the drive: by its name, or from the file itself.
void read_map(TomlTable& table, TurntableConfig& config) {
  const bool named = table.wants("map");
  const bool reported_here = table.wants("inline");
  if (named) table.read("map", config.map, 4096);
  if (named && reported_here) {
    table.refuse("map", hal::Error::of(hal::ErrorCode::kContradiction,
                                       "the register map is named and reported as well", "", "map, inline",
                                       "one of them", "leave one out"));
  } else if (reported_here) {
    config.map.clear();
    config.modbus.map = {};
    config.modbus.map.name = "inline";
    if (auto error = read_turntable_map(table.table("inline"), config.modbus.map))
      table.refuse("inline", *error);
  } else if (named || config.kind == TurntableChoice::kModbus) {
    auto map = find_turntable_map(config.map);
    if (map) {
      config.modbus.map = std::move(*map);
    } else {
      hal::Error error = map.error();
      if (!error.where.empty()) error.what = error.where + ": " + error.what;
      table.refuse("map", std::move(error));
    }
  }
}

void turntable_fields(auto& table, auto& config) {
  auto& settings = config.settings;
  auto& supervision = settings.supervision;
  table.field("kind", config.kind, kKinds);
  table.field("min_deg", settings.min_deg, kAngleDeg);
  table.field("max_deg", settings.max_deg, kAngleDeg);
  table.field("speed_deg_per_s", settings.speed_deg_per_s, kSpeed);
  table.field("acceleration_deg_per_s2", settings.acceleration_deg_per_s2, kAcceleration);
  table.field("tolerance_deg", supervision.tolerance_deg, kToleranceDeg);
  table.field("settle_s", supervision.settle_s, kSettleS);
  table.field("stall_after_s", supervision.stall_after_s, kStallS);
  table.field("stall_distance_deg", supervision.stall_distance_deg, kToleranceDeg);
  table.field("arrival_margin_s", supervision.arrival_margin_s, kMarginS);
  table.field("homing_timeout_s", supervision.homing_timeout_s, kHomingS);
  table.field("stop_timeout_s", supervision.stop_timeout_s, kMarginS);
  table.field("poll_hz", settings.poll_hz, kPollHz);
  table.field("stale_after_s", settings.stale_after_s, kStaleS);
  table.field("busy_timeout_s", settings.busy_timeout_s, kTimeoutS);
  table.field("engage_timeout_s", settings.engage_timeout_s, kEngageS);
  table.field("reconnect_after_s", settings.reconnect_after_s, kPauseS);
  table.field("reconnect_longest_s", settings.reconnect_longest_s, kPauseS);
}

void interlock_and_sim_fields(auto& table, auto& config) {
  auto interlock = table.table("interlock");
  interlock.field("contact_force_n", config.interlock.contact_force_n, kForceN);
  interlock.field("device_force_n", config.interlock.device_force_n, kForceN);
  interlock.field("turn_without_sensor", config.interlock.turn_without_sensor);
  interlock.field("sensor_silence_s", config.interlock.sensor_silence_s, kTimeoutS);
  interlock.field("loop_silence_s", config.interlock.loop_silence_s, kTimeoutS);

  auto sim = table.table("sim");
  sim.field("start_deg", config.sim.start_deg, kAngleDeg);
  sim.field("homing_deg_per_s", config.sim.homing_deg_per_s, kSpeed);
  sim.field("homed", config.sim.homed);
}

}  // namespace

void read_turntable(TomlTable table, TurntableConfig& config) {
  turntable_fields(table, config);
  read_stations(table.table("stations"), config.settings.stations);
  interlock_and_sim_fields(table, config);
  TomlTable drive = table.table("modbus");
  drive_fields(drive, config);
  read_map(drive, config);
}

std::string write_turntable(const TurntableConfig& config) {
  std::string text;
  TomlWriter table = TomlWriter(text, "rig").table("turntable");
  turntable_fields(table, config);
  for (const hal::TurntableStation& station : config.settings.stations) {
    TomlWriter inner = table.table("stations." + station.name);
    station_fields(inner, station);
  }
  interlock_and_sim_fields(table, config);
  TomlWriter drive = table.table("modbus");
  drive_fields(drive, config);
  if (!config.map.empty()) {
    drive.field("map", config.map);
    return text;
  }
  return text + write_turntable_map(config.modbus.map, "rig.turntable.modbus.inline");
}

}  // namespace hapticd::server
