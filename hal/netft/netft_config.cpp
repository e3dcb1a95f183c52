#include "hal/netft/netft_config.h"

#include <algorithm>

#include "hal/axis_map.h"
#include "hal/nano17_calibration.h"
#include "hal/netft/netft_configuration.h"
#include "hal/netft/netft_units.h"
#include "hal/shown_text.h"

namespace hapticd::netft {

namespace {

std::string place(const char* key) {
  return std::string("[rig.netft] ") + key;
}

struct Bound {
  const char* key;
  double value;
  double least;
  double most;
  const char* unit;
};

}  // namespace

std::optional<hal::Error> check(const NetFtConfig& config) {
  const Bound bounds[] = {
      {"rdt_port", static_cast<double>(config.rdt_port), 1.0, 65535.0, ""},
      {"http_port", static_cast<double>(config.http_port), 1.0, 65535.0, ""},
      {"rate_hz", config.rate_hz, 1.0, 100'000.0, " Hz"},
      {"lowest_rate_hz", config.lowest_rate_hz, 1.0, 100'000.0, " Hz"},
      {"connect_timeout_s", config.connect_timeout_s, 0.1, 60.0, " s"},
      {"stale_after_ms", config.stale_after_ms, 2.0, 10'000.0, " ms"},
      {"retry_first_ms", config.retry_first_ms, 5.0, 60'000.0, " ms"},
      {"retry_longest_ms", config.retry_longest_ms, 5.0, 60'000.0, " ms"},
      {"tool_mass_g", config.tool_mass_g, 0.0, 10'000.0, " g"},
      {"counts_per_force", config.counts_per_force, 1e-6, 1e12, " counts per unit"},
      {"counts_per_torque", config.counts_per_torque, 1e-6, 1e12, " counts per unit"},
      {"fifo_priority", static_cast<double>(config.fifo_priority), 0.0, 99.0, ""},
  };
  for (const Bound& bound : bounds) {
    if (!(bound.value >= bound.least && bound.value <= bound.most)) {
      return hal::Error{
          .what = std::string("'") + bound.key + "' is out of range",
          .where = place(bound.key),
          .value = hal::number_text(bound.value, 9) + bound.unit,
          .limit = hal::number_text(bound.least, 9) + " … " + hal::number_text(bound.most, 9) + bound.unit,
          .remedy = "correct the value",
          .code = hal::ErrorCode::kOutOfRange};
    }
  }
  if (config.lowest_rate_hz > config.rate_hz) {
    return hal::Error{.what = "the lowest rate is above the expected rate",
                      .where = place("lowest_rate_hz"),
                      .value = hal::number_text(config.lowest_rate_hz, 9) + " Hz",
                      .limit = "at most rate_hz, " + hal::number_text(config.rate_hz, 9) + " Hz",
                      .remedy = "lower it",
                      .code = hal::ErrorCode::kContradiction};
  }
  if (config.retry_first_ms > config.retry_longest_ms) {
    return hal::Error{
        .what = "the first retry waits longer than the longest",
        .where = place("retry_first_ms"),
        .value = hal::number_text(config.retry_first_ms, 9) + " ms",
        .limit = "at most retry_longest_ms, " + hal::number_text(config.retry_longest_ms, 9) + " ms",
        .remedy = "lower it",
        .code = hal::ErrorCode::kContradiction};
  }
  // The address goes into an HTTP request: it must not end the line or begin a path.
  constexpr std::string_view kInNames = "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789.-_:";
  if (config.address.empty() || config.address.size() > 253 ||
      config.address.find_first_not_of(kInNames) != std::string::npos) {
    return hal::Error{.what = "the address is not a host name or number",
                      .where = place("address"),
                      .value = "'" + config.address.substr(0, 60) + "'",
                      .limit = "e.g. \"192.168.1.1\"",
                      .remedy = "give the box's address only, without http:// and port",
                      .code = hal::ErrorCode::kMalformed};
  }
  const bool clean_path = config.http_path.starts_with('/') && config.http_path.size() <= 1024 &&
                          std::none_of(config.http_path.begin(), config.http_path.end(), [](char c) {
                            return static_cast<unsigned char>(c) <= 0x20 || c == 0x7f;
                          });
  if (!clean_path) {
    return hal::Error{.what = "the path is not valid",
                      .where = place("http_path"),
                      .value = "'" + config.http_path.substr(0, 60) + "'",
                      .limit = "begins with '/', no blanks, at most 1024 bytes",
                      .remedy = "write e.g. \"/netftapi2.xml\"",
                      .code = hal::ErrorCode::kMalformed};
  }
  if (config.low_pass_hz &&
      std::find(kLowPassHz.begin(), kLowPassHz.end(), *config.low_pass_hz) == kLowPassHz.end()) {
    return hal::Error{.what = "the box has no such filter",
                      .where = place("low_pass_hz"),
                      .value = hal::number_text(*config.low_pass_hz, 9) + " Hz",
                      .limit = "0 (none), 5, 8, 18, 35, 73, 152, 326, 838, 1500, 2000, 2500, 3000 Hz",
                      .remedy = "use one of those, or leave the key out to accept any",
                      .code = hal::ErrorCode::kUnknownWord};
  }
  const auto calibration = hal::find_nano17_calibration(config.model, place("model"));
  if (!calibration) return calibration.error();
  const auto axes = hal::AxisMap::parse(config.axes, place("axes"));
  if (!axes) return axes.error();
  const auto force = newtons_per(config.force_unit, place("force_unit"));
  if (!force) return force.error();
  const auto torque = newton_millimetres_per(config.torque_unit, place("torque_unit"));
  if (!torque) return torque.error();
  return std::nullopt;
}

}  // namespace hapticd::netft
