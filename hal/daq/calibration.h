#pragma once

#include <array>
#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

#include "hal/error.h"

namespace hapticd::daq {

inline constexpr std::size_t kGauges = 6;

/// Converts gauge voltages to a load; from the file that comes with an ATI sensor.
struct Calibration {
  std::string serial;       ///< e.g. "FT12345"
  std::string body_style;   ///< e.g. "Nano17"
  std::string part_number;  ///< e.g. "SI-25-0.25"
  std::string file_version;
  /// Output range of the gauge amplifiers, V.
  double output_low_v = -10.0;
  double output_high_v = 10.0;
  /// Rows Fx Fy Fz [N/V], Tx Ty Tz [N·mm/V]; columns gauges 0 … 5. Load = matrix · (V - V_bias), about the
  /// origin that the sensor's maker chose.
  std::array<std::array<double, kGauges>, 6> matrix{};
  std::array<double, 6> max_load{};  ///< rated: N, N·mm; 0 = the file does not say
  std::vector<std::string> notes;    ///< requests of the file that are not applied
};

/// Reads the text of a .cal file, CalFileVersion 1.0 or 1.1. `source` names it in errors. If the file holds
/// several calibrations, `part_number` selects one. Errors name the element: not XML, wrong root, number of
/// gauges, version, units, missing or repeated axis, count of numbers, non-finite number, singular matrix.
///
/// Parses a calibration. Version 1.1 holds the matrix ready for use (UserAxis). In 1.0 each Axis row is
/// divided by its scale and the torques are moved by the BasicTransform: T' = R (T - d × F), F' = R F.
hal::Result<Calibration> parse_calibration(std::string_view text, const std::string& source,
                                           std::string_view part_number = {});

/// Reads a calibration from a file of at most 1 MiB.
hal::Result<Calibration> load_calibration(const std::string& path, std::string_view part_number = {});

}  // namespace hapticd::daq
