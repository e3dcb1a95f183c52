#pragma once

#include <span>
#include <string>
#include <string_view>

#include "hal/error.h"

namespace hapticd::hal {

/// One of the calibrations a Nano17 is sold with (data sheet; resolution of a 16-bit system).
struct Nano17Calibration {
  std::string_view model;    ///< as in `SensorInfo::model`, e.g. "nano17_si_25"
  std::string_view name;     ///< as the manufacturer names it, e.g. "SI-25-0.25"
  double range_across_n;     ///< Fx and Fy
  double range_along_n;      ///< Fz
  double range_torque_n_mm;  ///< each of Tx, Ty, Tz
  double resolution_n;       ///< of each force
  double resolution_n_mm;    ///< of each torque
};

std::span<const Nano17Calibration> nano17_calibrations();
/// Finds a calibration by model or by the manufacturer's name. `where` is the place for the error.
Result<Nano17Calibration> find_nano17_calibration(std::string_view model, std::string_view where);

}  // namespace hapticd::hal
