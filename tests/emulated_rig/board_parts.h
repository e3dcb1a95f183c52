#pragma once

#include <memory>

#include "hal/daq/board_instrument.h"
#include "hal/daq/daq_sensor.h"
#include "tests/emulators/board/scripted_board.h"
#include "tests/support/temporary_folder.h"

namespace hapticd::test {

/// The sensor's driver on the board's gauges, with the calibration file that the board's maker gave along.
std::unique_ptr<daq::DaqSensor> sensor_on(const std::shared_ptr<emulators::ScriptedBoard>& board,
                                          TemporaryFolder& folder, double tool_mass_g);

/// An instrument's driver on the inputs after the gauges', which see the tip along x, y and z.
std::unique_ptr<daq::BoardInstrument> instrument_on(const std::shared_ptr<emulators::ScriptedBoard>& board,
                                                    double mm_per_v);

}  // namespace hapticd::test
