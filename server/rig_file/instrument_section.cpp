#include "server/rig_file/instrument_section.h"

#include <fmt/format.h>

#include <algorithm>

#include "server/rig_file/whole_numbers.h"

namespace hapticd::server {

namespace {

constexpr const char* kPlace = "[rig.board_instrument]";
constexpr Range kChannel{-1.0, 255.0, ""};
constexpr Range kMmPerV{-1000.0, 1000.0, "mm/V"};
constexpr Range kEngageTimeoutS{0.1, 60.0, "s"};

void instrument_fields(auto& table, auto& config) {
  whole_numbers(table, "channels", config.channels, kChannel);
  table.field("mm_per_v", config.mm_per_v, kMmPerV);
  table.field("engage_timeout_s", config.engage_timeout_s, kEngageTimeoutS);
}

}  // namespace

void read_instrument(TomlTable table, daq::BoardInstrumentConfig& config) {
  instrument_fields(table, config);
}

std::string write_instrument(const daq::BoardInstrumentConfig& config) {
  return toml_fields([&](auto& table) { instrument_fields(table, config); });
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
