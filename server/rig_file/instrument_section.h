#pragma once

#include <string>

#include "hal/daq/board_config.h"
#include "hal/daq/board_instrument.h"
#include "server/text/toml_reader.h"

namespace hapticd::server {

/// [rig.board_instrument]: measures the tip from outside, on inputs of the board.
void read_instrument(TomlTable table, daq::BoardInstrumentConfig& config);
/// Writes every key with its value, without the table's header; reads back as the same.
std::string write_instrument(const daq::BoardInstrumentConfig& config);

/// daq::check(). If the force sensor is on the board too: no channel is used by one of its gauges.
std::optional<hal::Error> check_instrument(const daq::BoardInstrumentConfig& config,
                                           const daq::BoardConfig& board, bool sensor_on_board);

}  // namespace hapticd::server
