#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "hal/error.h"

namespace hapticd::netft {

/// What subtracts the reading of the unloaded sensor when bias() is called.
enum class BiasBy : std::uint8_t {
  kNone,      ///< readings are the box's own, and bias() is refused
  kSoftware,  ///< this driver: the mean of a quarter of a second
  kBox,       ///< the box, on command; checked afterwards
};

/// Address of a Net F/T box and the expected settings. All defaults are here.
struct NetFtConfig {
  std::string address = "192.168.1.1";  ///< name or number of the box; this is its factory setting
  int rdt_port = 49152;                 ///< UDP
  int http_port = 80;
  std::string http_path = "/netftapi2.xml";

  double rate_hz = 7000.0;           ///< expected of the box; a lower rate is a finding
  double lowest_rate_hz = 1000.0;    ///< below this engage() refuses: ticks would go without a sample
  double connect_timeout_s = 5.0;    ///< from engage() to the first good sample
  double stale_after_ms = 100.0;     ///< silence that counts as lost; a mean spans no more than this
  double retry_first_ms = 50.0;      ///< then the stream is requested again after this time …
  double retry_longest_ms = 2000.0;  ///< … doubling up to this
  BiasBy bias = BiasBy::kSoftware;

  std::string model = "nano17_si_25";  ///< determines the ranges; see hal/nano17_calibration.h
  std::string serial;                  ///< of the calibration that must be active; empty = any
  std::optional<double> low_pass_hz;   ///< filter expected on the box, 0 = none; absent = any
  double tool_mass_g = 0.0;            ///< mass beyond the sensor; 0 = unknown
  std::string axes = "+x +y +z";       ///< the tool's axes in terms of the sensor's; see hal/axis_map.h

  /// False for peers without the HTTP page: then the next four values are used, and nothing else is
  /// checked.
  bool read_configuration = true;
  double counts_per_force = 1e6;
  double counts_per_torque = 1e6;
  std::string force_unit = "N";
  std::string torque_unit = "Nm";

  int fifo_priority = 75;  ///< of the receiving thread: SCHED_FIFO 1 … 99, below the loop's; 0 = ordinary
};

/// Finds the first invalid value, if there is one.
std::optional<hal::Error> check(const NetFtConfig& config);

}  // namespace hapticd::netft
