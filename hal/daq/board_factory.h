#pragma once

#include <memory>
#include <string>
#include <vector>

#include "hal/daq/board.h"
#include "hal/daq/board_config.h"

namespace hapticd::daq {

/// Makes the board for the configured driver; opens nothing yet. Errors: a driver that is unknown or not
/// built in, values that no board accepts.
hal::Result<std::shared_ptr<Board>> create_board(const BoardConfig& config);

std::vector<std::string> board_drivers();

/// Makes a board driven by comedi. Built without libcomedi: always an error that says so.
hal::Result<std::shared_ptr<Board>> create_comedi_board(const BoardConfig& config);
bool has_comedi() noexcept;

}  // namespace hapticd::daq
