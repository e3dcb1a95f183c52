#pragma once

#include <array>
#include <string>

#include "hal/samples.h"

namespace hapticd::emulators {

/// Place and axes in which a sensor's maker wants the load reported, for the file's BasicTransform.
struct SensorTransform {
  std::array<double, 3> displacement_mm{0.0, 0.0, 6.096};
  std::array<double, 3> rotation_deg{};
};

/// How a calibration file is written.
struct CalibrationFileStyle {
  std::string version = "1.1";
  bool newton_metres = false;  ///< torques in N-m and lengths in m, not N-mm and mm
  int decimals = 12;           ///< of the rows' numbers
  SensorTransform transform{};
};

/// Six gauges on three beams, 120° apart: what they read under a load, and the file that says how to read
/// them. Made up, with the proportions of a small six-axis sensor on ± 10 V.
class GaugeEmulator {
 public:
  GaugeEmulator();
  /// Volts of the gauges under a load about the user's origin.
  std::array<double, 6> volts(const hal::Vector3& force_n, const hal::Vector3& torque_n_mm) const;
  /// Load per volt, N and N·mm: the inverse, by elimination.
  const std::array<std::array<double, 6>, 6>& load_per_volt() const { return load_per_volt_; }
  std::string calibration_file(const CalibrationFileStyle& style) const;

 private:
  std::array<std::array<double, 6>, 6> volts_per_load_{};
  std::array<std::array<double, 6>, 6> load_per_volt_{};
};

}  // namespace hapticd::emulators
