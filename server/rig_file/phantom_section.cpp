#include "server/rig_file/phantom_section.h"

#include <fmt/format.h>

#include "server/text/suggestion.h"
#include "server/text/toml_writer.h"

namespace hapticd::server {

namespace {

using phantom::PhantomConfig;

/// All keys but the model.
void phantom_fields(auto& table, auto& c) {
  table.field("first_link_mm", c.arm.first_link_mm, Range{10.0, 2000.0, "mm"});
  table.field("second_link_mm", c.arm.second_link_mm, Range{10.0, 2000.0, "mm"});
  table.field("most_q2_over_q3_rad", c.arm.most_q2_over_q3_rad, Range{0.0, 1.5, "rad"});
  table.field("most_q3_over_q2_rad", c.arm.most_q3_over_q2_rad, Range{0.0, 1.5, "rad"});
  table.field("stop_tolerance_rad", c.stop_tolerance_rad, Range{0.0, 1.0, "rad"});
  table.field("thermal_time_constant_s", c.thermal_time_constant_s, Range{0.1, 1e4, "s"});
  table.field("max_force_n", c.max_force_n, Range{0.01, 1000.0, "N"});
  table.field("max_continuous_force_n", c.max_continuous_force_n, Range{0.001, 1000.0, "N"});
  table.field("apparent_mass_g", c.apparent_mass_g, Range{1.0, 1e4, "g"});
  table.field("structural_stiffness_n_per_mm", c.structural_stiffness_n_per_mm, Range{0.0, 1e6, "N/mm"});
  table.field("structural_mode_hz", c.structural_mode_hz, Range{0.0, 1000.0, "Hz"});
  table.field("coulomb_friction_n", c.coulomb_friction_n, Range{0.0, 100.0, "N"});
  table.field("max_speed_mm_per_s", c.max_speed_mm_per_s, Range{1.0, 1e5, "mm/s"});
  table.field("max_joint_speed_rad_per_s", c.max_joint_speed_rad_per_s, Range{0.1, 1e4, "rad/s"});
  table.field("watchdog_ms", c.watchdog_ms, Range{1.0, 1000.0, "ms"});
  table.field("home_still_ms", c.home_still_ms, Range{0.0, 10'000.0, "ms"});
  // One number for each joint, or for each axis of the gimbal.
  table.field("joint_low_rad", c.arm.low_rad, Range{-6.3, 6.3, "rad"});
  table.field("joint_high_rad", c.arm.high_rad, Range{-6.3, 6.3, "rad"});
  table.field("reset_pose_rad", c.reset_pose_rad, Range{-6.3, 6.3, "rad"});
  table.field("transmission", c.transmission, Range{0.1, 1000.0, ""});
  table.field("encoder_counts_per_turn", c.encoder_counts_per_turn, Range{4.0, 1e8, ""});
  table.field("encoder_sign", c.encoder_sign, Range{-1.0, 1.0, ""});
  table.field("gimbal_counts_per_turn", c.gimbal_counts_per_turn, Range{-1e8, 1e8, ""});
  table.field("gimbal_reset_rad", c.gimbal_reset_rad, Range{-6.3, 6.3, "rad"});
  table.field("torque_constant_n_mm_per_a", c.torque_constant_n_mm_per_a, Range{0.01, 1e5, "N·mm/A"});
  table.field("amplifier_gain_a_per_v", c.amplifier_gain_a_per_v, Range{1e-4, 1e4, "A/V"});
  table.field("motor_sign", c.motor_sign, Range{-1.0, 1.0, ""});
  table.field("peak_current_a", c.peak_current_a, Range{1e-3, 1e3, "A"});
  table.field("continuous_current_a", c.continuous_current_a, Range{1e-4, 1e3, "A"});
  table.field("origin_mm", c.origin_mm, Range{-1e5, 1e5, "mm"});
  table.field("gimbal", c.gimbal);
  table.field("home_on_engage", c.home_on_engage);
}

}  // namespace

void read_phantom(TomlTable table, PhantomConfig& config) {
  std::string model = config.model;
  table.read("model", model, 64);
  if (model != config.model) {
    if (const auto preset = phantom::phantom_preset(model)) {
      config = *preset;
    } else {
      const auto known = phantom::phantom_presets();
      table.refuse(
          "model",
          hal::Error::of(hal::ErrorCode::kUnknownWord, fmt::format("unknown device model '{}'", model), "",
                         model, comma_separated(known), did_you_mean(model, known, "use one of those")));
    }
  }
  phantom_fields(table, config);
}

std::string write_phantom(const PhantomConfig& config) {
  return toml_fields([&](auto& table) {
    table.field("model", config.model);
    phantom_fields(table, config);
  });
}

}  // namespace hapticd::server
