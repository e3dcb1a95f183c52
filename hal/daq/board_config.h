#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

namespace hapticd::daq {

/// How the counters of a comedi board become encoder counters.
enum class CounterSetup : std::uint8_t {
  kAsIs,  ///< already set up by the driver or a script (e.g. s626, whose counters are made for encoders)
  kNiQuadrature,  ///< general-purpose counters of a National Instruments board, four counts a line
};

enum class InputReference : std::uint8_t { kDifferential, kGround, kCommon };

struct ComediConfig {
  std::string device = "/dev/comedi0";

  int input_subdevice = -1;  ///< -1 = the first that can stream
  std::array<double, 6> input_channels{0.0, 1.0, 2.0, 3.0, 4.0, 5.0};
  double input_low_v = -10.0;  ///< the narrowest range of the board that contains both ends is used
  double input_high_v = 10.0;
  InputReference input_reference = InputReference::kDifferential;

  int output_subdevice = -1;  ///< -1 = the first analog output
  std::array<double, 3> output_channels{0.0, 1.0, 2.0};
  double output_low_v = -10.0;
  double output_high_v = 10.0;

  /// Subdevice and channel of each encoder's counter: three joints, then up to three of the gimbal.
  std::vector<std::array<double, 2>> counters{{4.0, 0.0}, {4.0, 1.0}, {4.0, 2.0}};
  CounterSetup counter_setup = CounterSetup::kAsIs;

  /// True: a board that is calibrated by software must have its calibration file. False: the nominal ranges
  /// are used, which are wrong by a few parts in a thousand.
  bool calibrated = true;
  std::string calibration_file{};  ///< empty = where comedi keeps it
  int fifo_priority = 0;           ///< of the acquisition's thread; 0 = an ordinary one
};

/// [rig.board]: which board and how it is wired. Sensor and device may share it.
struct BoardConfig {
  std::string driver = "comedi";
  double scan_rate_hz = 10000.0;  ///< of all gauges together
  ComediConfig comedi{};
  /// Inputs of an instrument, scanned after the gauges. At most kSpareInputs.
  std::vector<double> spare_channels{};
};

}  // namespace hapticd::daq
