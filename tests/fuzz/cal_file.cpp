// Calibration files: whatever the bytes, an answer; and an answer that is finite.

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <string_view>

#include "hal/daq/calibration.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string_view text(reinterpret_cast<const char*>(data), size);
  for (const std::string_view part_number : {std::string_view{}, std::string_view{"SI-25-0.25"}}) {
    const auto calibration = hapticd::daq::parse_calibration(text, "fuzz", part_number);
    if (!calibration) {
      if (calibration.error().text().empty()) std::abort();
      continue;
    }
    for (const auto& row : calibration->matrix) {
      for (const double value : row) {
        if (!std::isfinite(value)) std::abort();
      }
    }
    if (!(calibration->output_low_v < calibration->output_high_v)) std::abort();
  }
  return 0;
}
