#include "server/rig_file/turntable_section.h"

#include <fmt/format.h>

#include "server/rig_file/turntable_map.h"
#include "server/text/text_library.h"
#include "server/text/toml_text.h"

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
    inner.read("angle_deg", station.angle_deg, kAngleDeg);
    inner.read("object", station.object, 64);
    inner.read("tool_mm", station.tool_mm, kToolMm);
    if (!inner.has("angle_deg")) {
      table.refuse(name, hal::Error::of(hal::ErrorCode::kMissingKey, "the station has no angle", "", name,
                                        "angle_deg = …", "add it"));
    }
    stations.push_back(std::move(station));
  }
}

void read_modbus(TomlTable table, TurntableConfig& config) {
  modbus::LinkConfig& link = config.modbus.link;
  table.read("transport", link.transport, kTransports);
  table.read("host", link.host, 255);
  table.read("port", link.port, kPort);
  table.read("device", link.device, 255);
  table.read("baud", link.baud, kBaud);
  table.read("parity", link.parity, kParities);
  table.read("data_bits", link.data_bits, kDataBits);
  table.read("stop_bits", link.stop_bits, kStopBits);
  table.read("rs485", link.rs485);
  table.read("unit", link.unit, kUnit);
  table.read("response_timeout_s", link.response_timeout_s, kTimeoutS);
  table.read("connect_timeout_s", link.connect_timeout_s, kTimeoutS);
  modbus::Gear& gear = config.modbus.gear;
  table.read("steps_per_motor_turn", gear.steps_per_motor_turn, kSteps);
  table.read("motor_turns_per_turn", gear.motor_turns_per_turn, kGear);
  table.read("reversed", gear.reversed);
  table.read("zero_deg", gear.zero_deg, kAngleDeg);

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

}  // namespace

void read_turntable(TomlTable table, TurntableConfig& config) {
  turntable::TurntableSettings& settings = config.settings;
  turntable::SupervisionSettings& supervision = settings.supervision;
  table.read("kind", config.kind, kKinds);
  table.read("min_deg", settings.min_deg, kAngleDeg);
  table.read("max_deg", settings.max_deg, kAngleDeg);
  table.read("speed_deg_per_s", settings.speed_deg_per_s, kSpeed);
  table.read("acceleration_deg_per_s2", settings.acceleration_deg_per_s2, kAcceleration);
  table.read("tolerance_deg", supervision.tolerance_deg, kToleranceDeg);
  table.read("settle_s", supervision.settle_s, kSettleS);
  table.read("stall_after_s", supervision.stall_after_s, kStallS);
  table.read("stall_distance_deg", supervision.stall_distance_deg, kToleranceDeg);
  table.read("arrival_margin_s", supervision.arrival_margin_s, kMarginS);
  table.read("homing_timeout_s", supervision.homing_timeout_s, kHomingS);
  table.read("stop_timeout_s", supervision.stop_timeout_s, kMarginS);
  table.read("poll_hz", settings.poll_hz, kPollHz);
  table.read("stale_after_s", settings.stale_after_s, kStaleS);
  table.read("busy_timeout_s", settings.busy_timeout_s, kTimeoutS);
  table.read("engage_timeout_s", settings.engage_timeout_s, kEngageS);
  table.read("reconnect_after_s", settings.reconnect_after_s, kPauseS);
  table.read("reconnect_longest_s", settings.reconnect_longest_s, kPauseS);
  read_stations(table.table("stations"), settings.stations);

  TomlTable interlock = table.table("interlock");
  interlock.read("contact_force_n", config.interlock.contact_force_n, kForceN);
  interlock.read("device_force_n", config.interlock.device_force_n, kForceN);
  interlock.read("turn_without_sensor", config.interlock.turn_without_sensor);
  interlock.read("sensor_silence_s", config.interlock.sensor_silence_s, kTimeoutS);
  interlock.read("loop_silence_s", config.interlock.loop_silence_s, kTimeoutS);

  TomlTable sim = table.table("sim");
  sim.read("start_deg", config.sim.start_deg, kAngleDeg);
  sim.read("homing_deg_per_s", config.sim.homing_deg_per_s, kSpeed);
  sim.read("homed", config.sim.homed);
  read_modbus(table.table("modbus"), config);
}

std::string write_turntable(const TurntableConfig& config) {
  const turntable::TurntableSettings& s = config.settings;
  std::string text = fmt::format("\n[rig.turntable]\nkind = {}\n", toml_quoted(text_of(config.kind, kKinds)));
  const auto number = [&text](std::string_view key, double value) {
    text += fmt::format("{} = {}\n", key, toml_number(value));
  };
  number("min_deg", s.min_deg);
  number("max_deg", s.max_deg);
  number("speed_deg_per_s", s.speed_deg_per_s);
  number("acceleration_deg_per_s2", s.acceleration_deg_per_s2);
  number("tolerance_deg", s.supervision.tolerance_deg);
  number("settle_s", s.supervision.settle_s);
  number("stall_after_s", s.supervision.stall_after_s);
  number("stall_distance_deg", s.supervision.stall_distance_deg);
  number("arrival_margin_s", s.supervision.arrival_margin_s);
  number("homing_timeout_s", s.supervision.homing_timeout_s);
  number("stop_timeout_s", s.supervision.stop_timeout_s);
  number("poll_hz", s.poll_hz);
  number("stale_after_s", s.stale_after_s);
  number("busy_timeout_s", s.busy_timeout_s);
  number("engage_timeout_s", s.engage_timeout_s);
  number("reconnect_after_s", s.reconnect_after_s);
  number("reconnect_longest_s", s.reconnect_longest_s);
  for (const hal::TurntableStation& station : s.stations) {
    text += fmt::format(
        "\n[rig.turntable.stations.{}]\nangle_deg = {}\nobject = {}\ntool_mm = [{}, {}, {}]\n", station.name,
        toml_number(station.angle_deg), toml_quoted(station.object), toml_number(station.tool_mm.x),
        toml_number(station.tool_mm.y), toml_number(station.tool_mm.z));
  }
  text += "\n[rig.turntable.interlock]\n";
  number("contact_force_n", config.interlock.contact_force_n);
  number("device_force_n", config.interlock.device_force_n);
  text += fmt::format("turn_without_sensor = {}\n", config.interlock.turn_without_sensor);
  number("sensor_silence_s", config.interlock.sensor_silence_s);
  number("loop_silence_s", config.interlock.loop_silence_s);
  text += "\n[rig.turntable.sim]\n";
  number("start_deg", config.sim.start_deg);
  number("homing_deg_per_s", config.sim.homing_deg_per_s);
  text += fmt::format("homed = {}\n", config.sim.homed);
  const modbus::LinkConfig& link = config.modbus.link;
  text += fmt::format(
      "\n[rig.turntable.modbus]\ntransport = {}\nhost = {}\nport = {}\ndevice = {}\nbaud = {}\nparity = "
      "{}\ndata_bits = {}\n"
      "stop_bits = {}\nrs485 = {}\nunit = {}\n",
      toml_quoted(text_of(link.transport, kTransports)), toml_quoted(link.host), link.port,
      toml_quoted(link.device), link.baud, toml_quoted(text_of(link.parity, kParities)), link.data_bits,
      link.stop_bits, link.rs485, link.unit);
  number("response_timeout_s", link.response_timeout_s);
  number("connect_timeout_s", link.connect_timeout_s);
  number("steps_per_motor_turn", config.modbus.gear.steps_per_motor_turn);
  number("motor_turns_per_turn", config.modbus.gear.motor_turns_per_turn);
  text += fmt::format("reversed = {}\n", config.modbus.gear.reversed);
  number("zero_deg", config.modbus.gear.zero_deg);
  if (!config.map.empty()) return text + fmt::format("map = {}\n", toml_quoted(config.map));
  return text + write_turntable_map(config.modbus.map, "rig.turntable.modbus.inline");
}

}  // namespace hapticd::server
