#include "server/config/config.h"

#include <fmt/format.h>
#include <sys/un.h>

#include <charconv>
#include <cstdlib>

#include "server/config/config_words.h"
#include "server/rig_file/instrument_section.h"
#include "server/rig_file/sim_section.h"
#include "server/text/suggestion.h"
#include "server/text/text_library.h"

namespace hapticd::server {

namespace {

template <class E, std::size_t N>
std::optional<hal::Error> read_word(std::string_view text, E& value, const Word<E> (&words)[N],
                                    std::string_view what, std::string_view where) {
  for (const Word<E>& word : words) {
    if (word.text == text) {
      value = word.value;
      return std::nullopt;
    }
  }
  const auto list = texts(words);
  return hal::Error::of(hal::ErrorCode::kUnknownWord, fmt::format("unknown {} '{}'", what, text),
                        std::string(where), std::string(text), comma_separated(list),
                        did_you_mean(text, list, "use one of those"));
}

std::optional<hal::Error> read_number(std::string_view text, double& value, const Range& range,
                                      std::string_view what, std::string_view where) {
  double number = 0.0;
  const auto [end, failure] = std::from_chars(text.data(), text.data() + text.size(), number);
  if (failure != std::errc{} || end != text.data() + text.size()) {
    return hal::Error::of(hal::ErrorCode::kWrongType, fmt::format("{} is not a number", what),
                          std::string(where), std::string(text), to_text(range), "write a number");
  }
  if (auto error = check(number, range, what, where)) return error;
  value = number;
  return std::nullopt;
}

/// Reads one "key=value" of a replay's query.
std::optional<hal::Error> apply_query(std::string_view key, std::string_view value,
                                      replay::ReplayConfig& replay, std::string_view where) {
  struct Column {
    std::string_view name;
    replay::ColumnMapping* mapping;
  };
  const Column columns[] = {{"time", &replay.time}, {"force", &replay.force}, {"position", &replay.position}};
  std::vector<std::string> known = {"speed", "loop", "bias_s", "decimal_comma"};
  for (const Column& column : columns) {
    if (key == column.name) {
      column.mapping->column = value;
      return std::nullopt;
    }
    if (key == std::string(column.name) + "_unit") {
      column.mapping->unit = value;
      return std::nullopt;
    }
    if (key == std::string(column.name) + "_scale") {
      return read_number(value, column.mapping->scale, kReplayScale, fmt::format("'{}'", key), where);
    }
    known.insert(known.end(), {std::string(column.name), std::string(column.name) + "_unit",
                               std::string(column.name) + "_scale"});
  }
  if (key == "speed") return read_word(value, replay.as_fast_as_possible, kSpeedWords, "speed", where);
  if (key == "bias_s") return read_number(value, replay.bias_s, kReplayBiasS, "'bias_s'", where);
  if (key == "loop" || key == "decimal_comma") {
    constexpr Word<bool> kFlags[] = {{"true", true}, {"false", false}};
    return read_word(value, key == "loop" ? replay.loop : replay.decimal_comma, kFlags,
                     fmt::format("value of '{}':", key), where);
  }
  return hal::Error::of(hal::ErrorCode::kUnknownKey,
                        fmt::format("unknown option '{}' of a replayed rig", key), std::string(where),
                        std::string(key), comma_separated(known), did_you_mean(key, known, "remove it"));
}

std::optional<hal::Error> check_network(const DaemonConfig& config) {
  for (const ListenAddress& address : {config.listen, config.listen_tls.value_or(config.listen)}) {
    if (address.port < UINT16_MAX) continue;
    return hal::Error::of(hal::ErrorCode::kOutOfRange, "there is no next port, by which stops come",
                          "[network] listen, listen_tls", address.text(), "up to port 65534",
                          "choose another port");
  }
  if (!config.listen_tls) return std::nullopt;
  const ListenAddress& tls = *config.listen_tls;
  if (config.certificates.empty()) {
    return hal::Error::of(
        hal::ErrorCode::kMissingKey, "refusing to listen beyond this machine without certificates",
        "[network] certificates", "", "a folder with server.crt, server.key and authority.crt",
        "make them with deploy/make_certificates.sh, then --certificates DIR");
  }
  const bool anywhere = tls.host == "0.0.0.0" || tls.host == "::" || tls.host == config.listen.host;
  const int apart = std::abs(int{tls.port} - int{config.listen.port});
  if (anywhere && apart <= 1 && tls.port != 0 && config.listen.port != 0) {
    return hal::Error::of(hal::ErrorCode::kContradiction, "the two addresses to listen on take the same port",
                          "[network] listen_tls", tls.text(),
                          "not the port of " + config.listen.text() +
                              ", nor one next to it: stops come by the next port of each",
                          "choose another port, or one address of this machine, e.g. 192.168.1.20:50051");
  }
  return std::nullopt;
}

/// Checks of several values together.
std::optional<hal::Error> check_together(const DaemonConfig& config) {
  if (config.rig == RigChoice::kReplay && config.replay.path.empty()) {
    return hal::Error::of(hal::ErrorCode::kMissingKey, "a replayed rig needs a recording",
                          "[rig.replay] path", "", "a CSV or MCAP file",
                          "name it in the file or as --rig replay:PATH");
  }
  const bool names_parts = config.device != DeviceChoice::kOfKind || config.sensor != SensorChoice::kOfKind;
  if (config.rig == RigChoice::kHardware && !names_parts) {
    return hal::Error::of(hal::ErrorCode::kMissingKey, "a rig of hardware alone names no part",
                          "[rig] device, sensor", "of_kind",
                          "device = openhaptics or phantom, sensor = netft or daq",
                          "name what is there, or let a simulation stand in: kind = \"sim\"");
  }
  if (config.instrument == InstrumentChoice::kBoard) {
    if (config.device == DeviceChoice::kOfKind) {
      return hal::Error::of(hal::ErrorCode::kContradiction,
                            "an instrument of hardware cannot see the tip of a simulated device",
                            "[rig] instrument", "board", "with device = openhaptics or phantom",
                            "name the device, or leave the instrument out: a simulated rig has its own");
    }
    if (auto error =
            check_instrument(config.board_instrument, config.board, config.sensor == SensorChoice::kDaq)) {
      return error;
    }
  }
  if (config.rig == RigChoice::kReplay && names_parts && config.replay.as_fast_as_possible) {
    return hal::Error::of(
        hal::ErrorCode::kContradiction, "a recording next to hardware cannot be played as fast as possible",
        "[rig.replay] speed", "fast", "recorded", "hardware keeps real time: set speed = \"recorded\"");
  }
  if (names_parts && config.rig == RigChoice::kSimulated && !config.simulation.real_time) {
    return hal::Error::of(hal::ErrorCode::kContradiction,
                          "a simulation next to hardware cannot have a time of its own", "[rig.sim] speed",
                          fmt::format("{}", config.simulation.speed), "1",
                          "hardware keeps real time: leave speed out");
  }
  if (auto error = check_network(config)) return error;
  constexpr std::size_t kMaxSocketPath = sizeof(sockaddr_un::sun_path) - 1 - 5;  // and ".stop" beside it
  if (config.unix_socket.size() > kMaxSocketPath) {
    return hal::Error::of(hal::ErrorCode::kTooLong, "the path of the unix socket is too long",
                          "[network] unix_socket", fmt::format("{} bytes", config.unix_socket.size()),
                          fmt::format("at most {} bytes", kMaxSocketPath), "use a shorter path");
  }
  if (!config.scene.empty()) {
    if (auto error = check_name("scene", config.scene, "[scene] load")) return error;
  }
  return std::nullopt;
}

}  // namespace

hal::Result<DaemonConfig> override_config(DaemonConfig config, const ConfigOverrides& overrides) {
  if (overrides.rig) {
    if (auto error = apply_rig_text(*overrides.rig, config)) return *error;
  }
  if (overrides.listen) {
    auto address = parse_listen_address(*overrides.listen, "--listen");
    if (!address) return address.error();
    config.listen = *address;
  }
  if (overrides.listen_tls) {
    auto address = parse_tls_address(*overrides.listen_tls, "--listen-tls");
    if (!address) return address.error();
    config.listen_tls = *address;
  }
  if (overrides.certificates) config.certificates = *overrides.certificates;
  if (overrides.unix_socket) config.unix_socket = *overrides.unix_socket;
  if (overrides.scene) config.scene = *overrides.scene;
  if (overrides.scene_folder) config.scene_folder = *overrides.scene_folder;
  if (overrides.model_folder) config.model_folder = *overrides.model_folder;
  if (overrides.model_store) config.model_store = *overrides.model_store;
  if (overrides.rate_hz) {
    if (auto error = check(*overrides.rate_hz, kLoopRateHz, "the loop rate", "--rate-hz")) return *error;
    config.loop.rate_hz = *overrides.rate_hz;
  }
  if (overrides.log_level) {
    if (auto error =
            read_word(*overrides.log_level, config.log_level, kLogWords, "log level", "--log-level")) {
      return *error;
    }
  }
  config.simulation.rate_hz = config.loop.rate_hz;
  config.replay.rate_hz = config.loop.rate_hz;
  config.openhaptics.rate_hz = config.loop.rate_hz;
  if (auto error = check_together(config)) return *error;
  return config;
}

std::optional<hal::Error> apply_rig_text(std::string_view text, DaemonConfig& config) {
  constexpr std::string_view kWhere = "--rig";
  const std::size_t colon = text.find(':');
  const std::string_view kind = text.substr(0, colon);
  const std::string_view rest = colon == std::string_view::npos ? std::string_view{} : text.substr(colon + 1);
  if (auto error = read_word(kind, config.rig, kRigWords, "kind of rig", kWhere)) {
    error->limit = "sim, sim:PRESET, replay:PATH, hardware";
    return error;
  }
  if (config.rig == RigChoice::kHardware) {
    if (rest.empty()) return std::nullopt;
    return hal::Error::of(hal::ErrorCode::kMalformed, "hardware takes no more words", std::string(kWhere),
                          std::string(rest), "hardware", "say in the configuration file what is there");
  }
  if (config.rig == RigChoice::kSimulated) {
    apply_simulation_text(rest, config.simulation);
    return std::nullopt;
  }
  const std::size_t mark = rest.find('?');
  if (mark != 0 && !rest.empty()) config.replay.path = rest.substr(0, mark);
  std::string_view query = mark == std::string_view::npos ? std::string_view{} : rest.substr(mark + 1);
  while (!query.empty()) {
    const std::string_view pair = query.substr(0, query.find('&'));
    query.remove_prefix(std::min(pair.size() + 1, query.size()));
    const std::size_t equals = pair.find('=');
    if (equals == std::string_view::npos) {
      return hal::Error::of(hal::ErrorCode::kMalformed, "an option of a replayed rig has no value",
                            std::string(kWhere), std::string(pair), "key=value",
                            "write key=value, separated by &");
    }
    if (auto error = apply_query(pair.substr(0, equals), pair.substr(equals + 1), config.replay, kWhere)) {
      return error;
    }
  }
  return std::nullopt;
}

}  // namespace hapticd::server
