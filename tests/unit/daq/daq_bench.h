#pragma once

#include <gtest/gtest.h>

#include <memory>
#include <utility>

#include "hal/daq/daq_sensor.h"
#include "tests/emulators/board/scripted_board.h"
#include "tests/support/temporary_folder.h"

namespace hapticd::test {

/// A sensor on a scripted board, with the board's own calibration in a file. Engaged in real time, from then
/// on time is at rest but for pass_ms().
class DaqBench {
 public:
  explicit DaqBench(const emulators::ScriptedBoardConfig& board_config = {},
                    daq::DaqSensorConfig sensor_config = {})
      : board(std::make_shared<emulators::ScriptedBoard>(board_config)) {
    sensor_config.calibration_file = folder.write("sensor.cal", board->gauges().calibration_file({}));
    auto made = daq::DaqSensor::create(sensor_config, board);
    EXPECT_TRUE(made) << made.error().text();
    if (made) sensor = std::move(*made);
  }

  void engage() {
    const auto error = sensor->engage();
    ASSERT_FALSE(error) << error->text();
    board->freeze_time();
    read();  // what came in between
  }

  void pass_ms(double ms) { board->advance_ns(static_cast<std::int64_t>(1e6 * ms)); }

  hal::RigSample read() {
    hal::RigSample sample;
    sensor->read(sample);
    return sample;
  }
  /// One tick of a millisecond.
  hal::RigSample tick() {
    pass_ms(1.0);
    return read();
  }

  TemporaryFolder folder;
  std::shared_ptr<emulators::ScriptedBoard> board;
  std::unique_ptr<daq::DaqSensor> sensor;
};

}  // namespace hapticd::test
