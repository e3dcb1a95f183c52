// The sections of a rig file that speak of the board, the sensor on it and the device on it.

#include <gtest/gtest.h>

#include <string>

#include "server/config/config.h"
#include "server/rig_file/daq_section.h"
#include "server/rig_file/instrument_section.h"
#include "server/rig_file/phantom_section.h"
#include "server/text/toml_text.h"
#include "tests/support/refusals.h"
#include "tests/support/value_of.h"

namespace hapticd::server {
namespace {

/// Reads [part] of a text with one of the section readers.
template <class Config>
hal::Result<Config> read(const std::string& text, void (*reader)(TomlTable, Config&)) {
  auto document = TomlDocument::parse("[part]\n" + text, "rig.toml");
  if (!document) return document.error();
  Config config;
  reader(document->root().table("part"), config);
  if (auto error = document->error()) return *error;
  return config;
}

hal::Result<daq::BoardConfig> read_board_text(const std::string& text) {
  return read<daq::BoardConfig>(text, read_board);
}

TEST(BoardSection, ReadsBackAsWritten) {
  daq::BoardConfig config;
  EXPECT_EQ(write_board(*read<daq::BoardConfig>("", read_board)), write_board(config)) << "defaults";
  config.scan_rate_hz = 7000.5;
  config.comedi.device = "/dev/comedi3";
  config.comedi.input_subdevice = 2;
  config.comedi.input_channels = {16.0, 17.0, 18.0, 19.0, 20.0, 21.0};
  config.comedi.input_low_v = -5.0;
  config.comedi.input_high_v = 5.0;
  config.comedi.input_reference = daq::InputReference::kGround;
  config.comedi.output_channels = {3.0, 2.0, 1.0};
  config.comedi.counters = {{11.0, 0.0}, {12.0, 0.0}, {13.0, 0.0}, {14.0, 0.0}};
  config.comedi.counter_setup = daq::CounterSetup::kNiQuadrature;
  config.comedi.calibrated = false;
  config.comedi.calibration_file = "/etc/a \"file\".calibration";
  config.comedi.fifo_priority = 80;
  const auto again = test::value_of(read<daq::BoardConfig>(write_board(config), read_board));
  EXPECT_EQ(write_board(again), write_board(config));
  EXPECT_EQ(again.comedi.counters, config.comedi.counters);
  EXPECT_EQ(again.comedi.input_channels, config.comedi.input_channels);
  EXPECT_EQ(again.comedi.counter_setup, config.comedi.counter_setup);
  EXPECT_EQ(again.comedi.calibration_file, config.comedi.calibration_file);
}

TEST(BoardSection, WrongValuesAreNamedWithTheirLine) {
  using enum hal::ErrorCode;
  test::expect_refusals(
      {
          {"scan_rate_hz = 1e9", "'part.scan_rate_hz'", kOutOfRange, 2},
          {"scan_rate_hz = nan", "'part.scan_rate_hz'", kNotFinite, 2},
          {"input_channels = [0, 1, 2]", "'part.input_channels'", kWrongType, 2},
          {"input_reference = \"diff\"", "'part.input_reference'", kUnknownWord, 2, "differential"},
          {"counter_setup = \"quadrature\"", "'part.counter_setup'", kUnknownWord, 2, "ni_quadrature"},
          {"counters = [[0, 1, 2]]", "'part.counters'", kWrongType, 2},
          {"input_low_v = 10.0", "'input_low_v'", kContradiction, 2},
          {"output_low_v = 3.0\noutput_high_v = 2.0", "'output_high_v'", kContradiction, 3},
          {"scan_rate = 10000", "'scan_rate'", kUnknownKey, 2},
      },
      read_board_text);
}

TEST(InstrumentSection, ReadsBackAsWrittenAndIsCheckedOnLoad) {
  using enum hal::ErrorCode;
  const std::string rig =
      "[rig]\nkind = \"hardware\"\ndevice = \"openhaptics\"\nsensor = \"daq\"\ninstrument = \"board\"\n"
      "[rig.daq]\ncalibration_file = \"/a.cal\"\n[rig.board_instrument]\n";
  const auto good =
      test::value_of(parse_config(rig + "channels = [-1, -1, 6]\nmm_per_v = [1, 1, -2.5]\n", "rig.toml"));
  EXPECT_EQ(good.instrument, InstrumentChoice::kBoard);
  EXPECT_EQ(good.board_instrument.mm_per_v[2], -2.5);
  const auto again = test::value_of(parse_config(write_config(good), "again.toml"));
  EXPECT_EQ(write_config(again), write_config(good));

  const auto read_rig = [](const std::string& text) {
    auto config = parse_config(text, "rig.toml");
    return config ? override_config(*config, {}) : config;
  };
  test::expect_refusals(
      {
          {rig, "along z", kMissingKey},
          {rig + "channels = [6, 6, 7]", "one channel", kContradiction},
          {rig + "channels = [-1, -1, 5]", "channels", kContradiction},
          {rig + "channels = [-1, -1, 6]\nmm_per_v = [1, 1, 0]", "scale along z", kOutOfRange},
          {rig + "channels = [-1, -1, 6]\nmm_per_v = [1, 1, 5000]", "mm_per_v[2]", kOutOfRange, 10},
          {rig + "channel = [-1, -1, 6]", "'channel'", kUnknownKey},
          {"[rig]\ninstrument = \"board\"\n[rig.board_instrument]\nchannels = [-1, -1, 6]\n",
           "[rig] instrument", kContradiction},
      },
      read_rig);
}

TEST(DaqSection, ReadsBackAsWritten) {
  using enum hal::ErrorCode;
  daq::DaqSensorConfig config;
  EXPECT_EQ(write_daq(*read<daq::DaqSensorConfig>("", read_daq)), write_daq(config));
  config = {"/a/b.cal", "SI-12-0.12", "-x +y -z", 0.9, false, 5.0, 9.35};
  const auto again = test::value_of(read<daq::DaqSensorConfig>(write_daq(config), read_daq));
  EXPECT_EQ(write_daq(again), write_daq(config));
  EXPECT_EQ(again.axes, config.axes);
  EXPECT_FALSE(again.bias_on_engage);
  test::expect_refusals({{"saturation_share = 0.2", "'part.saturation_share'", kOutOfRange, 2},
                         {"cal_file = \"x\"", "'cal_file'", kUnknownKey, 2}},
                        [](const std::string& text) { return read<daq::DaqSensorConfig>(text, read_daq); });
}

TEST(PhantomSection, EveryPresetReadsBackAsWritten) {
  for (const std::string& model : phantom::phantom_presets()) {
    const phantom::PhantomConfig config = *phantom::phantom_preset(model);
    const std::string text = write_phantom(config);
    const auto again = test::value_of(read<phantom::PhantomConfig>(text, read_phantom));
    EXPECT_EQ(write_phantom(again), text);
    EXPECT_FALSE(phantom::check(again));
    // The name alone brings all of it.
    const auto short_text = read<phantom::PhantomConfig>("model = \"" + model + "\"", read_phantom);
    ASSERT_TRUE(short_text);
    EXPECT_EQ(write_phantom(*short_text), text);
  }
}

TEST(PhantomSection, KeysChangeThePreset) {
  const auto config = test::value_of(read<phantom::PhantomConfig>(
      "transmission = [1.0, 2.0, 3.0]\nmodel = \"phantom_premium_1_0\"\ngimbal = true\n"
      "origin_mm = [1, 2, 3]\nwatchdog_ms = 10\n",
      read_phantom));
  EXPECT_EQ(config.transmission, (std::array{1.0, 2.0, 3.0})) << "whatever their order";
  EXPECT_DOUBLE_EQ(config.arm.first_link_mm, 139.7);
  EXPECT_TRUE(config.gimbal);
  EXPECT_DOUBLE_EQ(config.origin_mm.y, 2.0);
  EXPECT_DOUBLE_EQ(config.watchdog_ms, 10.0);
  EXPECT_EQ(write_phantom(*read<phantom::PhantomConfig>(write_phantom(config), read_phantom)),
            write_phantom(config));
}

TEST(PhantomSection, WrongValuesAreNamed) {
  using enum hal::ErrorCode;
  test::expect_refusals(
      {
          {"model = \"phantom_premium_1_5_hi_force\"", "'phantom_premium_1_5_hi_force'", kUnknownWord, 2,
           "phantom_premium_1_5_high_force"},
          {"watchdog_ms = 0", "'part.watchdog_ms'", kOutOfRange, 2},
          {"transmission = 11.2", "'part.transmission'", kWrongType, 2},
          {"peak_current_a = [1, 1, inf]", "'part.peak_current_a[2]'", kNotFinite, 2},
          {"peak_current = [1, 1, 1]", "'peak_current'", kUnknownKey, 2},
      },
      [](const std::string& text) { return read<phantom::PhantomConfig>(text, read_phantom); });
}

/// The example of a README.
std::string example(const std::string& readme) {
  const auto text = read_text_file(std::string(HAPTICD_SOURCE_FOLDER) + "/" + readme);
  EXPECT_TRUE(text);
  const std::string opening = "```toml\n";
  const std::size_t from = text->find(opening);
  EXPECT_NE(from, std::string::npos);
  return text->substr(from + opening.size(), text->find("```", from + 1) - from - opening.size());
}

TEST(BoardSections, ExamplesOfTheReadmesAreRight) {
  auto board = test::value_of(TomlDocument::parse(example("hal/daq/README.md"), "hal/daq/README.md"));
  daq::BoardConfig board_config;
  daq::DaqSensorConfig sensor_config;
  read_board(board.root().table("rig").table("board"), board_config);
  read_daq(board.root().table("rig").table("daq"), sensor_config);
  daq::BoardInstrumentConfig instrument;
  read_instrument(board.root().table("rig").table("board_instrument"), instrument);
  EXPECT_FALSE(check_instrument(instrument, board_config, true));
  EXPECT_EQ(daq::channels_of(instrument), std::vector<double>{6.0});
  const auto board_error = board.error();
  EXPECT_FALSE(board_error) << board_error->text();
  EXPECT_EQ(write_board(board_config), write_board({})) << "it shows the defaults";

  auto device =
      test::value_of(TomlDocument::parse(example("hal/phantom/README.md"), "hal/phantom/README.md"));
  phantom::PhantomConfig config;
  read_phantom(device.root().table("rig").table("phantom"), config);
  const auto device_error = device.error();
  EXPECT_FALSE(device_error) << device_error->text();
  EXPECT_FALSE(phantom::check(config));
  EXPECT_NEAR(config.arm.high_rad[2], phantom::PhantomConfig{}.arm.high_rad[2], 1e-4);
}

}  // namespace
}  // namespace hapticd::server
