#include "server/rig_file/instrument_section.h"

#include <fmt/format.h>

#include <algorithm>

#include "server/text/toml_text.h"

namespace hapticd::server {

namespace {

constexpr const char* kPlace = "[rig.board_instrument]";
constexpr Range kChannel{-1.0, 255.0, ""};
constexpr Range kMmPerV{-1000.0, 1000.0, "mm/V"};
constexpr Range kEngageTimeoutS{0.1, 60.0, "s"};

}  // namespace

void read_instrument(TomlTable table, daq::BoardInstrumentConfig& config) {
  table.read("channels", config.channels, kChannel);
  table.read("mm_per_v", config.mm_per_v, kMmPerV);
  table.read("engage_timeout_s", config.engage_timeout_s, kEngageTimeoutS);
}

std::string write_instrument(const daq::BoardInstrumentConfig& config) {
  return fmt::format("channels = [{}]\nmm_per_v = [{}, {}, {}]\nengage_timeout_s = {}\n",
                     fmt::join(config.channels, ", "), toml_number(config.mm_per_v[0]),
                     toml_number(config.mm_per_v[1]), toml_number(config.mm_per_v[2]),
                     toml_number(config.engage_timeout_s));
}

std::optional<hal::Error> check_instrument(const daq::BoardInstrumentConfig& config,
                                           const daq::BoardConfig& board, bool sensor_on_board) {
  if (auto error = daq::check(config)) {
    error->where = kPlace;
    return error;
  }
  if (!sensor_on_board) return std::nullopt;
  const auto& gauges = board.comedi.input_channels;
  for (const double channel : daq::channels_of(config)) {
    if (std::find(gauges.begin(), gauges.end(), channel) == gauges.end()) continue;
    return hal::Error::of(hal::ErrorCode::kContradiction, "the instrument's channel is a gauge's",
                          fmt::format("{} channels", kPlace), fmt::format("{}", channel),
                          fmt::format("none of {}", fmt::join(gauges, ", ")),
                          "wire the instrument to an input of its own");
  }
  return std::nullopt;
}

}  // namespace hapticd::server
