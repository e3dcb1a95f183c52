#include "server/rig_file/openhaptics_section.h"

#include <fmt/format.h>

#include <array>
#include <cmath>

#include "hal/openhaptics/device_figures.h"
#include "server/text/suggestion.h"
#include "server/text/text_library.h"
#include "server/text/toml_text.h"

namespace hapticd::server {

namespace {

constexpr Range kRateHz{100.0, 10000.0, "Hz"};
constexpr Range kForceN{0.01, 50.0, "N"};
constexpr Range kStiffness{0.0, 100.0, "N/mm"};
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

}  // namespace

void read_openhaptics(TomlTable table, openhaptics::OpenHapticsConfig& config) {
  table.read("library", config.vendor_library_names, 4096);
  if (config.libraries().empty()) {
    table.refuse("library", hal::Error::of(hal::ErrorCode::kMalformed, "no library is named", "",
                                           config.vendor_library_names, "names or paths, separated by commas",
                                           "remove the key to try the usual names"));
  }
  table.read("device_name", config.device_name, 256);
  table.read("model", config.model, 64);
  if (!openhaptics::device_figures(config.model)) {
    const auto models = openhaptics::device_models();
    table.refuse("model", hal::Error::of(hal::ErrorCode::kUnknownWord, "unknown model of a PHANToM", "",
                                         config.model, comma_separated(models),
                                         did_you_mean(config.model, models,
                                                      "choose the one whose data sheet is closest")));
  }
  table.read("rate_hz", config.rate_hz, kRateHz);

  table.read("max_force_n", config.max_force_n, kForceN);
  table.read("max_continuous_force_n", config.max_continuous_force_n, kForceN);
  table.read("structural_stiffness_n_per_mm", config.structural_stiffness_n_per_mm, kStiffness);
  table.read("apparent_mass_g", config.apparent_mass_g, kMassG);
  table.read("position_resolution_mm", config.position_resolution_mm, kResolutionMm);

  table.read("origin_mm", config.origin_mm, kOriginMm);
  table.read("tip_offset_mm", config.tip_offset_mm, kOffsetMm);
  hal::Quaternion& q = config.tool_to_stylus;
  std::array<double, 4> wxyz{q.w, q.x, q.y, q.z};
  table.read("tool_to_stylus", wxyz, kQuaternion);
  const double length = std::hypot(std::hypot(wxyz[0], wxyz[1]), std::hypot(wxyz[2], wxyz[3]));
  if (std::abs(length - 1.0) <= 1e-3) {
    q = {wxyz[0], wxyz[1], wxyz[2], wxyz[3]};
  } else {
    table.refuse(
        "tool_to_stylus",
        hal::Error::of(hal::ErrorCode::kMalformed, "'tool_to_stylus' is not a rotation", "",
                       fmt::format("length {:.4g}", length), "w, x, y, z of length 1", "normalise it"));
  }

  table.read("warm_share", config.warm_share, kShare);
  table.read("reset_encoders", config.reset_encoders);
  table.read("calibration_wait_s", config.calibration_wait_s, kCalibrationS);
  table.read("patience_s", config.timeout_s, kTimeoutS);
  table.read("stall_s", config.stall_s, kStallS);
  table.read("death_s", config.death_s, kDeathS);
}

std::string write_openhaptics(const openhaptics::OpenHapticsConfig& config) {
  std::string text = fmt::format("library = {}\ndevice_name = {}\nmodel = {}\nrate_hz = {}\n",
                                 toml_quoted(config.vendor_library_names), toml_quoted(config.device_name),
                                 toml_quoted(config.model), toml_number(config.rate_hz));
  const auto optional = [&text](std::string_view key, const std::optional<double>& value) {
    if (value) text += fmt::format("{} = {}\n", key, toml_number(*value));
  };
  optional("max_force_n", config.max_force_n);
  optional("max_continuous_force_n", config.max_continuous_force_n);
  optional("structural_stiffness_n_per_mm", config.structural_stiffness_n_per_mm);
  optional("apparent_mass_g", config.apparent_mass_g);
  optional("position_resolution_mm", config.position_resolution_mm);
  const hal::Quaternion& q = config.tool_to_stylus;
  text += fmt::format("origin_mm = {}\ntip_offset_mm = {}\ntool_to_stylus = [{}, {}, {}, {}]\n",
                      toml_vector(config.origin_mm), toml_vector(config.tip_offset_mm), toml_number(q.w),
                      toml_number(q.x), toml_number(q.y), toml_number(q.z));
  text += fmt::format(
      "warm_share = {}\nreset_encoders = {}\ncalibration_wait_s = {}\npatience_s = {}\nstall_s = {}\n"
      "death_s = {}\n",
      toml_number(config.warm_share), config.reset_encoders, toml_number(config.calibration_wait_s),
      toml_number(config.timeout_s), toml_number(config.stall_s), toml_number(config.death_s));
  return text;
}

}  // namespace hapticd::server
