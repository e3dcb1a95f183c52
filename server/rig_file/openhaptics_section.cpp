#include "server/rig_file/openhaptics_section.h"

#include <fmt/format.h>

#include <array>
#include <cmath>

#include "hal/openhaptics/device_figures.h"
#include "server/text/suggestion.h"
#include "server/text/text_library.h"
#include "server/text/toml_writer.h"

namespace hapticd::server {

namespace {

constexpr Range kRateHz{100.0, 10000.0, "Hz"};
constexpr Range kForceN{0.01, 50.0, "N"};
constexpr Range kStiffness{0.0, 100.0, "N/mm"};
constexpr Range kModeHz{0.0, 1000.0, "Hz"};
constexpr Range kMassG{0.0, 5000.0, "g"};
constexpr Range kResolutionMm{1e-6, 1.0, "mm"};
constexpr Range kOriginMm{-1000.0, 1000.0, "mm"};
constexpr Range kOffsetMm{-500.0, 500.0, "mm"};
constexpr Range kQuaternion{-1.0, 1.0, ""};
constexpr Range kShare{0.1, 1.0, ""};
constexpr Range kCalibrationS{0.0, 60.0, "s"};
constexpr Range kTimeoutS{0.1, 120.0, "s"};
constexpr Range kStallS{0.005, 10.0, "s"};
constexpr Range kDeathS{0.1, 3600.0, "s"};

template <class Table>
void rotation_field(Table& table, auto& q) {
  std::array<double, 4> wxyz{q.w, q.x, q.y, q.z};
  table.field("tool_to_stylus", wxyz, kQuaternion);
  if constexpr (Table::kReads) {
    const double length = std::hypot(std::hypot(wxyz[0], wxyz[1]), std::hypot(wxyz[2], wxyz[3]));
    if (std::abs(length - 1.0) <= 1e-3) {
      q = {wxyz[0], wxyz[1], wxyz[2], wxyz[3]};
    } else {
      table.refuse(
          "tool_to_stylus",
          hal::Error::of(hal::ErrorCode::kMalformed, "'tool_to_stylus' is not a rotation", "",
                         fmt::format("length {:.4g}", length), "w, x, y, z of length 1", "normalise it"));
    }
  }
}

void openhaptics_fields(auto& table, auto& config) {
  table.field("library", config.vendor_library_names, 4096);
  table.field("device_name", config.device_name, 256);
  table.field("model", config.model, 64);
  table.field("rate_hz", config.rate_hz, kRateHz);
  table.field("max_force_n", config.max_force_n, kForceN);
  table.field("max_continuous_force_n", config.max_continuous_force_n, kForceN);
  table.field("structural_stiffness_n_per_mm", config.structural_stiffness_n_per_mm, kStiffness);
  table.field("structural_mode_hz", config.structural_mode_hz, kModeHz);
  table.field("apparent_mass_g", config.apparent_mass_g, kMassG);
  table.field("position_resolution_mm", config.position_resolution_mm, kResolutionMm);
  table.field("origin_mm", config.origin_mm, kOriginMm);
  table.field("tip_offset_mm", config.tip_offset_mm, kOffsetMm);
  rotation_field(table, config.tool_to_stylus);
  table.field("warm_share", config.warm_share, kShare);
  table.field("reset_encoders", config.reset_encoders);
  table.field("calibration_wait_s", config.calibration_wait_s, kCalibrationS);
  table.field("patience_s", config.timeout_s, kTimeoutS);
  table.field("stall_s", config.stall_s, kStallS);
  table.field("death_s", config.death_s, kDeathS);
}

}  // namespace

void read_openhaptics(TomlTable table, openhaptics::OpenHapticsConfig& config) {
  openhaptics_fields(table, config);
  if (config.libraries().empty()) {
    table.refuse("library", hal::Error::of(hal::ErrorCode::kMalformed, "no library is named", "",
                                           config.vendor_library_names, "names or paths, separated by commas",
                                           "remove the key to try the usual names"));
  }
  if (!openhaptics::device_figures(config.model)) {
    const auto models = openhaptics::device_models();
    table.refuse("model", hal::Error::of(hal::ErrorCode::kUnknownWord, "unknown model of a PHANToM", "",
                                         config.model, comma_separated(models),
                                         did_you_mean(config.model, models,
                                                      "choose the one whose data sheet is closest")));
  }
}

std::string write_openhaptics(const openhaptics::OpenHapticsConfig& config) {
  return toml_fields([&](auto& table) { openhaptics_fields(table, config); });
}

}  // namespace hapticd::server
