#pragma once

#include <string>

#include "hal/daq/board_config.h"
#include "hal/daq/daq_sensor.h"
#include "server/text/toml_reader.h"

namespace hapticd::server {

/// [rig.board]: the board that sensor and device may share.
void read_board(TomlTable table, daq::BoardConfig& config);
/// Writes every key with its value, without the table's header; reads back as the same.
std::string write_board(const daq::BoardConfig& config);

/// Reads the sensor on that board.
void read_daq(TomlTable table, daq::DaqSensorConfig& config);
std::string write_daq(const daq::DaqSensorConfig& config);

}  // namespace hapticd::server
