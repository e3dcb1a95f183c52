// The comedi board against a stand-in for what would reach the kernel: streaming, calibration, outputs,
// counters, and a stream that ends, overflows, falls silent or comes in pieces.

#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <thread>

#include "hal/daq/board_factory.h"
#include "hal/daq/daq_sensor.h"
#include "tests/emulators/board/comedi_stand_in.h"
#include "tests/emulators/board/gauge_emulator.h"
#include "tests/support/eventually.h"
#include "tests/support/part_report.h"
#include "tests/support/temporary_folder.h"
#include "tests/support/texts.h"
#include "tests/support/value_of.h"

namespace hapticd::daq {
namespace {

using emulators::ComediStandIn;
using std::chrono::milliseconds;

using test::eventually;

class ComediBoard : public testing::Test {
 protected:
  ComediBoard() {
    config.comedi.device = folder.write("comedi0", "");
    config.comedi.counters = {{3.0, 0.0}, {3.0, 1.0}, {3.0, 5.0}};
    stand_in.reset(config.comedi.device);
  }

  std::shared_ptr<Board> make() {
    auto made = create_board(config);
    EXPECT_TRUE(made) << made.error().text();
    return made ? *made : nullptr;
  }

  /// The newest scan, when there is one with these volts on the first input.
  static bool sees(Board& board, double volts, Scan* seen = nullptr) {
    return eventually([&] {
      std::array<Scan, 64> scans;
      const ScanReading reading = board.read_scans(scans);
      if (reading.count == 0) return false;
      const Scan& newest = scans[reading.count - 1];
      if (seen != nullptr) *seen = newest;
      return std::abs(newest.volts[0] - volts) < 1e-3;
    });
  }

  /// A board whose inputs are engaged and read 1 V.
  std::shared_ptr<Board> reading_1_v() {
    stand_in.set_inputs_v({1.0});
    auto board = make();
    EXPECT_FALSE(board->engage(BoardUse::kInputs));
    EXPECT_TRUE(sees(*board, 1.0));
    return board;
  }

  static double figure(const Board& board, const std::string& name) {
    hal::PartReport report;
    board.describe(report);
    return test::figure_of(report, name);
  }

  test::TemporaryFolder folder;
  BoardConfig config;
  ComediStandIn& stand_in = ComediStandIn::get();
};

TEST_F(ComediBoard, StreamsItsDifferentialChannelsAsVolts) {
  config.comedi.input_channels = {0.0, 1.0, 2.0, 3.0, 4.0, 9.0};
  for (const bool wide : {false, true}) {
    stand_in.reset(config.comedi.device);
    stand_in.set_wide_samples(wide);
    std::array<double, 16> volts{1.5, -2.5, 9.9, -9.9, 0.0};
    volts[9] = 4.25;
    stand_in.set_inputs_v(volts);
    const auto board = make();
    const auto error = board->engage(BoardUse::kInputs);
    ASSERT_FALSE(error) << error->text();
    Scan scan;
    ASSERT_TRUE(sees(*board, 1.5, &scan));
    for (std::size_t j = 0; j < 5; ++j) EXPECT_NEAR(scan.volts[j], volts[j], 20.0 / 65535.0);
    EXPECT_NEAR(scan.volts[5], 4.25, 20.0 / 65535.0);
    EXPECT_EQ(board->info().input_bits, wide ? 18 : 16);
    EXPECT_TRUE(stand_in.wakes_every_scan());
    ASSERT_EQ(stand_in.last_channels().size(), 6U);
    EXPECT_EQ(stand_in.last_channels()[5] & 0xffffU, 9U);
    EXPECT_EQ(stand_in.last_channels()[5] >> 24U, 2U) << "differential";
    board->release(BoardUse::kInputs);
    EXPECT_EQ(stand_in.opened(), 0);
  }
}

TEST_F(ComediBoard, AnInstrumentsChannelsAreScannedAfterTheGauges) {
  config.spare_channels = {11.0, 7.0};
  std::array<double, 16> volts{1.5};
  volts[11] = -3.25;
  volts[7] = 6.5;
  stand_in.set_inputs_v(volts);
  const auto board = make();
  ASSERT_FALSE(board->engage(BoardUse::kInputs));
  EXPECT_EQ(board->info().inputs, 8U);
  Scan scan;
  ASSERT_TRUE(sees(*board, 1.5, &scan));
  ASSERT_EQ(stand_in.last_channels().size(), 8U);
  EXPECT_EQ(stand_in.last_channels()[6] & 0xffffU, 11U);
  EXPECT_NEAR(scan.volts[6], -3.25, 20.0 / 65535.0);
  EXPECT_NEAR(scan.volts[7], 6.5, 20.0 / 65535.0);
  std::array<double, kSpareInputs> mean_v{};
  board->read_spare_inputs(mean_v);  // what came in between
  ASSERT_TRUE(eventually([&] { return board->read_spare_inputs(mean_v) > 0; }));
  EXPECT_NEAR(mean_v[0], -3.25, 20.0 / 65535.0);
  EXPECT_NEAR(mean_v[1], 6.5, 20.0 / 65535.0);
  config.spare_channels = {6.0, 7.0, 8.0, 9.0};
  EXPECT_TRUE(test::holds(test::error_of(create_board(config)).limit, "at most 3"));
}

TEST_F(ComediBoard, TakesTheNarrowestRangeThatHoldsWhatIsWanted) {
  config.comedi.input_low_v = -4.0;
  config.comedi.input_high_v = 4.0;
  stand_in.set_inputs_v({3.0});
  const auto board = make();
  ASSERT_FALSE(board->engage(BoardUse::kInputs));
  EXPECT_DOUBLE_EQ(board->info().input_high_v, 5.0);
  EXPECT_TRUE(sees(*board, 3.0));
  config.comedi.input_high_v = 40.0;
  EXPECT_TRUE(test::holds(test::error_of(make()->engage(BoardUse::kInputs)).what, "range"));
}

TEST_F(ComediBoard, ScansThatComeInPiecesArePutTogether) {
  stand_in.split_writes(true);
  stand_in.set_inputs_v({1.0, 2.0, 3.0, 4.0, 5.0, 6.0});
  const auto board = make();
  ASSERT_FALSE(board->engage(BoardUse::kInputs));
  std::size_t seen = 0;
  ASSERT_TRUE(eventually([&] {
    std::array<Scan, 64> scans;
    const ScanReading reading = board->read_scans(scans);
    for (std::size_t k = 0; k < reading.count; ++k) {
      for (std::size_t j = 0; j < 6; ++j) {
        EXPECT_NEAR(scans[k].volts[j], static_cast<double>(j + 1), 1e-3);
      }
    }
    seen += reading.count;
    return seen > 200;
  }));
}

TEST_F(ComediBoard, AnOverflowIsSaidOnceAndFixed) {
  const auto board = reading_1_v();
  const auto before = stand_in.commands();
  stand_in.overflow_stream();
  std::array<Scan, 64> scans;
  ASSERT_TRUE(eventually([&] { return board->read_scans(scans).overrun; }));
  EXPECT_FALSE(board->read_scans(scans).overrun);
  EXPECT_TRUE(sees(*board, 1.0));
  EXPECT_EQ(stand_in.commands(), before + 1);
  EXPECT_EQ(figure(*board, "board_overruns"), 1.0);
  EXPECT_EQ(stand_in.opened(), 1) << "the old handle is closed";
}

TEST_F(ComediBoard, AStreamThatEndsIsStartedAgain) {
  const auto board = reading_1_v();
  stand_in.set_busy(true);  // at first in vain
  stand_in.end_stream();
  std::array<Scan, 64> scans;
  ASSERT_TRUE(eventually([&] { return !board->read_scans(scans).running; }));
  std::this_thread::sleep_for(milliseconds(150));  // in which nothing starts, however often it is tried
  EXPECT_FALSE(board->read_scans(scans).running);
  stand_in.set_busy(false);
  ASSERT_TRUE(eventually([&] { return board->read_scans(scans).running; }));
  EXPECT_TRUE(sees(*board, 1.0));
  EXPECT_EQ(figure(*board, "board_restarts"), 1.0);
}

TEST_F(ComediBoard, AStreamThatFallsSilentIsStartedAgain) {
  const auto board = reading_1_v();
  stand_in.mute_stream(true);
  std::array<Scan, 64> scans;
  ASSERT_TRUE(eventually([&] { return !board->read_scans(scans).running; }));
  stand_in.mute_stream(false);
  EXPECT_TRUE(sees(*board, 1.0));
}

TEST_F(ComediBoard, ABoardThatWasPulledOutMayComeBack) {
  const auto board = reading_1_v();
  ASSERT_EQ(std::remove(config.comedi.device.c_str()), 0);
  stand_in.end_stream();
  std::array<Scan, 64> scans;
  ASSERT_TRUE(eventually([&] { return !board->read_scans(scans).running; }));
  folder.write("comedi0", "");
  EXPECT_TRUE(sees(*board, 1.0));
}

TEST_F(ComediBoard, InputsThatAnotherHoldsAreRefused) {
  stand_in.set_busy(true);
  EXPECT_TRUE(test::holds(test::error_of(make()->engage(BoardUse::kInputs)).remedy, "other program"));
  EXPECT_EQ(stand_in.opened(), 0);
}

TEST_F(ComediBoard, ARateTheBoardCannotDoIsRefusedWithTheNearest) {
  stand_in.set_fastest_scan_ns(200'000);
  EXPECT_TRUE(test::holds(test::error_of(make()->engage(BoardUse::kInputs)).limit, "5000.0 Hz"));
  config.scan_rate_hz = 5000.0;
  EXPECT_FALSE(make()->engage(BoardUse::kInputs));
}

TEST_F(ComediBoard, ChannelsAndSubdevicesThatAreNotThereAreRefused) {
  config.comedi.input_channels[5] = 99.0;
  auto error = make()->engage(BoardUse::kInputs);
  ASSERT_TRUE(error);
  EXPECT_TRUE(test::holds(error->limit, "0 … 15"));
  config.comedi.input_channels[5] = 5.0;
  config.comedi.input_subdevice = 2;
  error = make()->engage(BoardUse::kInputs);
  ASSERT_TRUE(error);
  EXPECT_EQ(error->value, "subdevice 2");
  config.comedi.counters = {{2.0, 0.0}};
  error = make()->engage(BoardUse::kMotion);
  ASSERT_TRUE(error);
  EXPECT_TRUE(test::holds(error->what, "counter"));
  EXPECT_EQ(stand_in.opened(), 0);
}

TEST_F(ComediBoard, OutputsAndCountersGoByOneInstructionListEach) {
  stand_in.set_counters({5, 0xfffffeU, 0, 0, 0, 77});
  const auto board = make();
  const auto error = board->engage(BoardUse::kMotion);
  ASSERT_FALSE(error) << error->text();
  EXPECT_EQ(board->info().counter_bits, 24);
  EXPECT_EQ(board->info().model, "stand-in-16");
  std::array<std::int64_t, 3> counts{};
  ASSERT_TRUE(board->read_counters(counts));
  EXPECT_EQ(counts, (std::array<std::int64_t, 3>{5, -2, 77})) << "24 bits, signed";
  ASSERT_TRUE(board->write_volts(std::array{0.0, 10.0, -10.0}));
  EXPECT_EQ(stand_in.output_counts()[0], 32768U);
  EXPECT_EQ(stand_in.output_counts()[1], 65535U);
  EXPECT_EQ(stand_in.output_counts()[2], 0U);
  ASSERT_TRUE(board->write_volts(std::array{5.0, 99.0, -99.0}));
  EXPECT_EQ(stand_in.output_counts()[0], 49151U);
  EXPECT_EQ(stand_in.output_counts()[1], 65535U);
  EXPECT_EQ(stand_in.output_counts()[2], 0U);
  stand_in.fail_instructions(true);
  EXPECT_FALSE(board->read_counters(counts));
  EXPECT_FALSE(board->write_volts(std::array{0.0, 0.0, 0.0}));
  stand_in.fail_instructions(false);
  ASSERT_TRUE(board->write_volts(std::array{1.0, 1.0, 1.0}));
  board->release(BoardUse::kMotion);
  EXPECT_EQ(stand_in.output_counts()[0], 32768U) << "zero volts are left";
  EXPECT_EQ(stand_in.opened(), 0);
  EXPECT_TRUE(stand_in.setup_calls().empty()) << "counters are as they were found";
}

TEST_F(ComediBoard, GeneralPurposeCountersAreSetUpForEncoders) {
  config.comedi.counters = {{3.0, 0.0}};
  config.comedi.counter_setup = CounterSetup::kNiQuadrature;
  const auto board = make();
  ASSERT_FALSE(board->engage(BoardUse::kMotion));
  const auto calls = stand_in.setup_calls();
  ASSERT_GE(calls.size(), 3U);
  EXPECT_EQ(calls.front(), "reset 3");
  EXPECT_EQ(calls.back(), "arm 3");
  // Quadrature, four counts a line (3 << 16), up and down by the hardware (2 << 24).
  EXPECT_NE(std::find(calls.begin(), calls.end(), "mode 3 " + std::to_string((3U << 16U) | (2U << 24U))),
            calls.end());
}

/// A calibration as comedi_soft_calibrate leaves one: 1 % less gain and an offset, for range 0.
std::string soft_calibration(unsigned subdevice) {
  return "#calibration file made for a test\n{\n\tdriver_name => \"stand_in\",\n\tboard_name => "
         "\"stand-in-16\",\n\tcalibrations =>\n\t[\n\t\t{\n\t\t\tsubdevice => " +
         std::to_string(subdevice) +
         ",\n\t\t\tchannels => [],\n\t\t\tranges => [0,],\n\t\t\tarefs => [],\n\t\t\tcaldacs =>\n\t\t\t[\n"
         "\t\t\t],\n\t\t\tsoftcal_to_phys =>\n\t\t\t{\n\t\t\t\texpansion_origin => 0,\n"
         "\t\t\t\tcoefficients => [-9.8,3.02129e-04,],\n\t\t\t},\n\t\t},\n\t],\n}\n";
}

TEST_F(ComediBoard, ASoftwareCalibrationIsUsed) {
  stand_in.set_soft_calibrated(true, folder.write("soft.calibration", soft_calibration(0)));
  stand_in.set_inputs_v({0.0});  // count 32768
  const auto board = make();
  const auto error = board->engage(BoardUse::kInputs);
  ASSERT_FALSE(error) << error->text();
  EXPECT_TRUE(sees(*board, -9.8 + 32768 * 3.02129e-04));
}

TEST_F(ComediBoard, AMissingSoftwareCalibrationIsRefusedUnlessDoneWithout) {
  stand_in.set_soft_calibrated(true, folder.path("none.calibration"));
  stand_in.set_inputs_v({2.0});
  const auto error = test::error_of(make()->engage(BoardUse::kInputs));
  EXPECT_TRUE(test::holds(error.remedy, "comedi_soft_calibrate"));
  config.comedi.calibrated = false;
  const auto board = make();
  ASSERT_FALSE(board->engage(BoardUse::kInputs));
  EXPECT_TRUE(sees(*board, 2.0));
}

TEST_F(ComediBoard, InputsAndMotionComeAndGoApart) {
  const auto board = make();
  ASSERT_FALSE(board->engage(BoardUse::kMotion));
  EXPECT_EQ(stand_in.opened(), 1);
  EXPECT_EQ(stand_in.last_channels().size(), 0U) << "no stream for a device alone";
  ASSERT_FALSE(board->engage(BoardUse::kInputs));
  EXPECT_EQ(stand_in.opened(), 2);
  board->release(BoardUse::kMotion);
  EXPECT_TRUE(sees(*board, 0.0));
  board->release(BoardUse::kInputs);
  EXPECT_EQ(stand_in.opened(), 0);
  ASSERT_FALSE(board->engage(BoardUse::kInputs)) << "and again";
  EXPECT_TRUE(sees(*board, 0.0));
}

// The whole way: gauges, board, stream, calibration, sensor.
TEST_F(ComediBoard, ASensorOnItSaysTheLoad) {
  const emulators::GaugeEmulator gauges;
  const auto put = [&](const hal::Vector3& force_n, const hal::Vector3& torque_n_mm) {
    std::array<double, 16> inputs{};
    const auto volts = gauges.volts(force_n, torque_n_mm);
    std::copy(volts.begin(), volts.end(), inputs.begin());
    for (double& v : inputs) v += 0.3;
    stand_in.set_inputs_v(inputs);
  };
  put({}, {});
  DaqSensorConfig sensor_config{.calibration_file = folder.write("sensor.cal", gauges.calibration_file({})),
                                .engage_timeout_s = 20.0};
  auto made = test::value_of(DaqSensor::create(sensor_config, make()));
  const auto error = made->engage();
  ASSERT_FALSE(error) << error->text();
  put({1.0, -2.0, 5.0}, {20.0, 0.0, -10.0});
  hal::RigSample sample;
  EXPECT_TRUE(eventually([&] {
    sample = {};
    made->read(sample);
    return sample.force_count > 0 && std::abs(sample.sensor_force_n.z - 5.0) < 0.01;
  }));
  EXPECT_EQ(sample.status, 0U);
  EXPECT_NEAR(sample.sensor_force_n.x, 1.0, 0.01);
  EXPECT_NEAR(sample.sensor_force_n.y, -2.0, 0.01);
  EXPECT_NEAR(sample.sensor_torque_n_mm.z, -10.0, 0.1);
  const hal::PartReport report = made->report();
  EXPECT_EQ(report.state, hal::PartState::kReady);
  EXPECT_TRUE(test::holds(report.connection, "comedi"));
  made->disengage();
  EXPECT_EQ(stand_in.opened(), 0);
}

}  // namespace
}  // namespace hapticd::daq
