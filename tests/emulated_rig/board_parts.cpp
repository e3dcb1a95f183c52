#include "tests/emulated_rig/board_parts.h"

#include "tests/support/value_of.h"

namespace hapticd::test {

std::unique_ptr<daq::DaqSensor> sensor_on(const std::shared_ptr<emulators::ScriptedBoard>& board,
                                          TemporaryFolder& folder, double tool_mass_g) {
  daq::DaqSensorConfig config;
  config.calibration_file = folder.write("sensor.cal", board->gauges().calibration_file({}));
  config.tool_mass_g = tool_mass_g;
  return value_of(daq::DaqSensor::create(config, board));
}

std::unique_ptr<daq::BoardInstrument> instrument_on(const std::shared_ptr<emulators::ScriptedBoard>& board,
                                                    double mm_per_v) {
  daq::BoardInstrumentConfig config;
  config.channels = {6.0, 7.0, 8.0};
  config.mm_per_v = {mm_per_v, mm_per_v, mm_per_v};
  return value_of(daq::BoardInstrument::create(config, board));
}

}  // namespace hapticd::test
