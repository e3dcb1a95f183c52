#pragma once

#include <optional>
#include <string>
#include <vector>

#include "hal/error.h"
#include "hal/samples.h"

namespace hapticd::openhaptics {

/// Configuration of a PHANToM behind the vendor's library.
struct OpenHapticsConfig {
  /// Names or paths of the library, separated by commas and tried in turn: the name differs between
  /// releases.
  std::string vendor_library_names =
      "libHD.so, libHD.so.3.5, libHD.so.3.5.0, libHD.so.3.4, libHD.so.3.4.0, libHD.so.3.0, libHD.so.3";
  std::string device_name{};  ///< as set up with the vendor's tool; empty = the default device
  std::string model = "phantom_premium_1_5";
  double rate_hz =
      1000.0;  ///< of the vendor's scheduler; FireWire and USB devices support 500, 1000 and few more

  std::optional<double> max_force_n{};  ///< lower than the device's own limit; absent = the device's
  std::optional<double> max_continuous_force_n{};         ///< instead of the device's own value
  std::optional<double> structural_stiffness_n_per_mm{};  ///< instead of the data sheet's; 0 = rigid
  double structural_mode_hz = 0.0;  ///< lowest mode of the bare device, free; 0 = unknown
  std::optional<double> apparent_mass_g{};
  std::optional<double> position_resolution_mm{};

  hal::Vector3 origin_mm{};  ///< the rig's origin in the device's coordinates (x right, y up, z to the user)
  hal::Vector3 tip_offset_mm{};  ///< from the measured point to the tip, tool frame
  /// Turns the tool's frame into the stylus's (z along the stylus, from tip to end), as w, x, y, z.
  hal::Quaternion tool_to_stylus{};

  double warm_share = 0.9;  ///< share of the rated motor temperature from which a motor is warm
  /// The device is in its reset position (all links at right angles) whenever it is engaged: its encoders
  /// are reset there. Only for devices that are calibrated in this way.
  bool reset_encoders = false;
  double calibration_wait_s = 2.0;  ///< how long engaging waits for an automatic calibration
  double timeout_s = 15.0;          ///< how long the library may take to open or close the device
  double stall_s = 0.1;             ///< without a call from the scheduler for this long: a fault
  double death_s = 5.0;             ///< without a call for this long, the run is abandoned

  /// The names in `vendor_library_names`, one by one.
  std::vector<std::string> libraries() const;
};

/// Finds the first value that is out of its range.
std::optional<hal::Error> check(const OpenHapticsConfig& config);

}  // namespace hapticd::openhaptics
