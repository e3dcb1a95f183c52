#pragma once

#include <memory>
#include <string>
#include <vector>

#include "hal/daq/board.h"
#include "hal/daq/board_config.h"

namespace hapticd::daq {

/// The board of that driver's name; opens nothing yet. Errors: a driver that is not known or not built in,
/// values that no board takes.
hal::Result<std::shared_ptr<Board>> create_board(const BoardConfig& config);

std::vector<std::string> board_drivers();

/// A board driven by comedi. Without libcomedi at build time always an error that says so.
hal::Result<std::shared_ptr<Board>> create_comedi_board(const BoardConfig& config);
bool has_comedi() noexcept;

}  // namespace hapticd::daq
