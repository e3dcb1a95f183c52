#include "hal/openhaptics/openhaptics_config.h"

#include <algorithm>
#include <cmath>

#include "hal/openhaptics/device_figures.h"
#include "hal/shown_text.h"

namespace hapticd::openhaptics {

std::vector<std::string> OpenHapticsConfig::libraries() const {
  std::vector<std::string> names;
  std::size_t from = 0;
  while (from <= vendor_library_names.size()) {
    const std::size_t comma = std::min(vendor_library_names.find(',', from), vendor_library_names.size());
    std::string name = vendor_library_names.substr(from, comma - from);
    const std::size_t first = name.find_first_not_of(" \t");
    if (first != std::string::npos) {
      names.push_back(name.substr(first, name.find_last_not_of(" \t") - first + 1));
    }
    from = comma + 1;
  }
  return names;
}

std::optional<hal::Error> check(const OpenHapticsConfig& config) {
  const std::string where = "OpenHaptics device";
  if (config.libraries().empty()) {
    return hal::Error::of(hal::ErrorCode::kMalformed, "no library is named", where + ", library",
                          config.vendor_library_names, "names or paths, separated by commas",
                          "remove the key to try the usual names");
  }
  if (!device_figures(config.model)) {
    return hal::Error::of(hal::ErrorCode::kUnknownWord, "unknown model", where + ", model", config.model,
                          hal::joined(device_models()), "choose the one whose data sheet is closest");
  }
  struct Bound {
    const char* key;
    double value, low, high;
    const char* unit;
  };
  const auto& origin = config.origin_mm;
  const auto& offset = config.tip_offset_mm;
  const Bound bounds[] = {
      {"rate_hz", config.rate_hz, 100.0, 10000.0, "Hz"},
      {"max_force_n", config.max_force_n.value_or(1.0), 0.01, 50.0, "N"},
      {"max_continuous_force_n", config.max_continuous_force_n.value_or(1.0), 0.01, 50.0, "N"},
      {"structural_stiffness_n_per_mm", config.structural_stiffness_n_per_mm.value_or(1.0), 0.0, 100.0,
       "N/mm"},
      {"apparent_mass_g", config.apparent_mass_g.value_or(1.0), 0.0, 5000.0, "g"},
      {"position_resolution_mm", config.position_resolution_mm.value_or(1e-3), 1e-6, 1.0, "mm"},
      {"origin_mm.x", origin.x, -1000.0, 1000.0, "mm"},
      {"origin_mm.y", origin.y, -1000.0, 1000.0, "mm"},
      {"origin_mm.z", origin.z, -1000.0, 1000.0, "mm"},
      {"tip_offset_mm.x", offset.x, -500.0, 500.0, "mm"},
      {"tip_offset_mm.y", offset.y, -500.0, 500.0, "mm"},
      {"tip_offset_mm.z", offset.z, -500.0, 500.0, "mm"},
      {"warm_share", config.warm_share, 0.1, 1.0, "of the rated temperature"},
      {"calibration_wait_s", config.calibration_wait_s, 0.0, 60.0, "s"},
      {"patience_s", config.timeout_s, 0.1, 120.0, "s"},
      {"stall_s", config.stall_s, 0.005, 10.0, "s"},
      {"death_s", config.death_s, 0.1, 3600.0, "s"},
  };
  for (const Bound& bound : bounds) {
    if (bound.value >= bound.low && bound.value <= bound.high) continue;
    return hal::Error::of(
        hal::ErrorCode::kOutOfRange, std::string(bound.key) + " is out of range", where + ", " + bound.key,
        hal::number_text(bound.value, 5),
        hal::number_text(bound.low, 5) + " … " + hal::number_text(bound.high, 5) + " " + bound.unit, "");
  }
  const hal::Quaternion& q = config.tool_to_stylus;
  const double length = std::sqrt(q.w * q.w + q.x * q.x + q.y * q.y + q.z * q.z);
  if (!(std::abs(length - 1.0) <= 1e-3)) {
    return hal::Error::of(hal::ErrorCode::kMalformed, "tool_to_stylus is not a rotation",
                          where + ", tool_to_stylus", "length " + hal::number_text(length, 5),
                          "four numbers w, x, y, z of length 1", "normalise it");
  }
  return std::nullopt;
}

}  // namespace hapticd::openhaptics
