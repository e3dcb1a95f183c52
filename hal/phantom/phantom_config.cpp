#include "hal/phantom/phantom_config.h"

#include <fmt/format.h>

#include <cmath>
#include <string_view>

namespace hapticd::phantom {

namespace {

// Values not in the data sheets. 1.0: shorter arm and, with the 1.5's motors and encoders, the transmission
// that gives the sheet's 8.5 N at stall (it then resolves 0.023 mm where the sheet says "0.03 nominal").
// High force: the 1.5's arm and transmissions; encoders that give the sheet's 0.007 mm; motors and
// amplifiers that give its 37.5 N and 6.2 N at the reset pose.
const std::vector<PhantomConfig>& presets() {
  static const std::vector<PhantomConfig> all = [] {
    PhantomConfig p10;
    p10.model = "phantom_premium_1_0";
    p10.arm.first_link_mm = 139.7;
    p10.arm.second_link_mm = 139.7;
    p10.transmission = {9.2, 9.2, 9.2};
    p10.continuous_current_a = {0.91, 0.91, 0.91};
    p10.coulomb_friction_n = 0.06;

    const PhantomConfig p15;

    PhantomConfig high_force = p15;
    high_force.model = "phantom_premium_1_5_high_force";
    high_force.encoder_counts_per_turn = {16384.0, 16384.0, 16384.0};
    high_force.torque_constant_n_mm_per_a = {60.0, 60.0, 60.0};
    high_force.amplifier_gain_a_per_v = {1.2, 1.2, 1.2};
    high_force.peak_current_a = {12.0, 12.0, 12.0};
    high_force.continuous_current_a = {1.98, 1.98, 1.98};
    high_force.thermal_time_constant_s = 20.0;
    high_force.max_force_n = 37.5;
    high_force.max_continuous_force_n = 6.2;
    high_force.apparent_mass_g = 150.0;
    high_force.structural_stiffness_n_per_mm = 2.537;
    high_force.coulomb_friction_n = 0.2;
    return std::vector<PhantomConfig>{p10, p15, high_force};
  }();
  return all;
}

/// A reported parameter, the models it applies to and why it is uncertain.
struct Uncertain {
  std::string_view models;  ///< "0", "5" and "H": the presets it applies to
  const char* name;
  double (*value)(const PhantomConfig&);
  const char* unit;
  const char* source;
};

constexpr Uncertain kUncertain[] = {
    {"0", "first_link_mm", [](const PhantomConfig& c) { return c.arm.first_link_mm; }, "mm",
     "literature, from memory: both links 5.5 in"},
    {"0", "second_link_mm", [](const PhantomConfig& c) { return c.arm.second_link_mm; }, "mm",
     "literature, from memory: both links 5.5 in"},
    {"0", "joint_stops", [](const PhantomConfig& c) { return c.arm.high_rad[1]; }, "rad",
     "taken from the 1.5, whose arm is longer"},
    {"0", "transmission", [](const PhantomConfig& c) { return c.transmission[1]; }, "1",
     "derived: with the 1.5's motors it makes the data sheet's 8.5 N"},
    {"H", "transmission", [](const PhantomConfig& c) { return c.transmission[1]; }, "1",
     "taken from the 1.5"},
    {"0H", "encoder_counts_per_turn", [](const PhantomConfig& c) { return c.encoder_counts_per_turn[1]; },
     "1", "1.0: taken from the 1.5; high force: derived from the data sheet's 0.007 mm"},
    {"0H", "torque_constant_n_mm_per_a",
     [](const PhantomConfig& c) { return c.torque_constant_n_mm_per_a[1]; }, "N·mm/A",
     "1.0: taken from the 1.5; high force: assumed"},
    {"05H", "amplifier_gain_a_per_v", [](const PhantomConfig& c) { return c.amplifier_gain_a_per_v[1]; },
     "A/V", "assumed: a little more than the peak current at 10 V; measure it before the motors are on"},
    {"H", "peak_current_a", [](const PhantomConfig& c) { return c.peak_current_a[1]; }, "A",
     "derived: makes the data sheet's 37.5 N with the assumed motor"},
    {"05H", "continuous_current_a", [](const PhantomConfig& c) { return c.continuous_current_a[1]; }, "A",
     "derived: makes the data sheet's continuous force at the reset pose"},
    {"05H", "thermal_time_constant_s", [](const PhantomConfig& c) { return c.thermal_time_constant_s; }, "s",
     "assumed: the winding alone, without the housing"},
    {"05H", "reset_pose_rad", [](const PhantomConfig& c) { return c.reset_pose_rad[1]; }, "rad",
     "assumed: first link level, second hanging"},
    {"05H", "gimbal_axes", [](const PhantomConfig& c) { return c.gimbal ? 1.0 : 0.0; }, "1",
     "assumed order: about the second link, across, along the stylus"},
    {"05H", "max_speed_mm_per_s", [](const PhantomConfig& c) { return c.max_speed_mm_per_s; }, "mm/s",
     "chosen: no intended stroke is faster"},
    {"05H", "coulomb_friction_n", [](const PhantomConfig& c) { return c.coulomb_friction_n; }, "N",
     "back-drive friction of the data sheet or, for the 1.0, of the literature"},
};

char letter_of(const std::string& model) {
  if (model == "phantom_premium_1_0") return '0';
  return model == "phantom_premium_1_5_high_force" ? 'H' : '5';
}

hal::Error bad(std::string_view name, double value, std::string_view limit) {
  return hal::Error::of(hal::ErrorCode::kOutOfRange, fmt::format("{} is out of range", name), "haptic device",
                        fmt::format("{}", value), std::string(limit), "correct the device's section");
}

}  // namespace

std::optional<PhantomConfig> phantom_preset(const std::string& model) {
  for (const PhantomConfig& preset : presets()) {
    if (preset.model == model) return preset;
  }
  return std::nullopt;
}

std::vector<std::string> phantom_presets() {
  std::vector<std::string> names;
  for (const PhantomConfig& preset : presets()) names.push_back(preset.model);
  return names;
}

std::vector<hal::UncertainParameter> uncertain_parameters(const PhantomConfig& config) {
  const PhantomConfig preset = phantom_preset(config.model).value_or(PhantomConfig{});
  std::vector<hal::UncertainParameter> list;
  for (const Uncertain& parameter : kUncertain) {
    if (parameter.models.find(letter_of(config.model)) == std::string_view::npos) continue;
    const double value = parameter.value(config);
    const bool configured = value != parameter.value(preset);
    list.push_back({parameter.name, value, parameter.unit, configured ? "configuration" : parameter.source});
  }
  return list;
}

std::optional<hal::Error> check(const PhantomConfig& c) {
  if (!phantom_preset(c.model)) {
    return hal::Error::of(hal::ErrorCode::kUnknownWord, fmt::format("unknown device model '{}'", c.model),
                          "haptic device", c.model, fmt::format("{}", fmt::join(phantom_presets(), ", ")),
                          "use one of those");
  }
  struct Bound {
    std::string_view name;
    double value;
    double low;
    double high;
    std::string_view text;
  };
  const auto within = [](const Bound& bound) -> std::optional<hal::Error> {
    if (bound.value >= bound.low && bound.value <= bound.high) return std::nullopt;
    return bad(bound.name, bound.value, bound.text);
  };
  const Bound single[] = {
      {"first_link_mm", c.arm.first_link_mm, 10.0, 2000.0, "10 … 2000 mm"},
      {"second_link_mm", c.arm.second_link_mm, 10.0, 2000.0, "10 … 2000 mm"},
      {"most_q2_over_q3_rad", c.arm.most_q2_over_q3_rad, 0.0, 1.5, "0 … 1.5 rad"},
      {"most_q3_over_q2_rad", c.arm.most_q3_over_q2_rad, 0.0, 1.5, "0 … 1.5 rad"},
      {"stop_tolerance_rad", c.stop_tolerance_rad, 0.0, 1.0, "0 … 1 rad"},
      {"origin_mm", std::sqrt(dot(c.origin_mm, c.origin_mm)), 0.0, 1e5, "at most 100 m"},
      {"thermal_time_constant_s", c.thermal_time_constant_s, 0.1, 1e4, "0.1 … 10000 s"},
      {"max_force_n", c.max_force_n, 0.01, 1000.0, "0.01 … 1000 N"},
      {"max_continuous_force_n", c.max_continuous_force_n, 0.001, c.max_force_n, "0.001 N … max_force_n"},
      {"apparent_mass_g", c.apparent_mass_g, 1.0, 1e4, "1 … 10000 g"},
      {"structural_stiffness_n_per_mm", c.structural_stiffness_n_per_mm, 0.0, 1e6, "0 … 1e6 N/mm"},
      {"structural_mode_hz", c.structural_mode_hz, 0.0, 1000.0, "0 … 1000 Hz; 0: unknown"},
      {"coulomb_friction_n", c.coulomb_friction_n, 0.0, 100.0, "0 … 100 N"},
      {"max_speed_mm_per_s", c.max_speed_mm_per_s, 1.0, 1e5, "1 … 100000 mm/s"},
      {"max_joint_speed_rad_per_s", c.max_joint_speed_rad_per_s, 0.1, 1e4, "0.1 … 10000 rad/s"},
      {"watchdog_ms", c.watchdog_ms, 1.0, 1000.0, "1 … 1000 ms"},
      {"home_still_ms", c.home_still_ms, 0.0, 10000.0, "0 … 10000 ms"},
  };
  for (const Bound& bound : single) {
    if (auto error = within(bound)) return error;
  }
  for (std::size_t i = 0; i < 3; ++i) {
    const Bound joint[] = {
        {"joint_low_rad", c.arm.low_rad[i], -6.3, 6.3, "-6.3 … 6.3 rad"},
        {"joint_high_rad", c.arm.high_rad[i], c.arm.low_rad[i], 6.3, "above joint_low_rad, to 6.3 rad"},
        {"reset_pose_rad", c.reset_pose_rad[i], c.arm.low_rad[i], c.arm.high_rad[i], "within the stops"},
        {"transmission", c.transmission[i], 0.1, 1000.0, "0.1 … 1000"},
        {"encoder_counts_per_turn", c.encoder_counts_per_turn[i], 4.0, 1e8, "4 … 1e8"},
        {"encoder_sign", std::abs(c.encoder_sign[i]), 1.0, 1.0, "1 or -1"},
        {"motor_sign", std::abs(c.motor_sign[i]), 1.0, 1.0, "1 or -1"},
        {"gimbal_counts_per_turn", std::abs(c.gimbal_counts_per_turn[i]), 4.0, 1e8, "4 … 1e8, either sign"},
        {"gimbal_reset_rad", c.gimbal_reset_rad[i], -6.3, 6.3, "-6.3 … 6.3 rad"},
        {"torque_constant_n_mm_per_a", c.torque_constant_n_mm_per_a[i], 0.01, 1e5, "0.01 … 1e5 N·mm/A"},
        {"amplifier_gain_a_per_v", c.amplifier_gain_a_per_v[i], 1e-4, 1e4, "0.0001 … 10000 A/V"},
        {"peak_current_a", c.peak_current_a[i], 1e-3, 1e3, "0.001 … 1000 A"},
        {"continuous_current_a", c.continuous_current_a[i], 1e-4, c.peak_current_a[i],
         "0.0001 A … peak_current_a"},
    };
    for (const Bound& bound : joint) {
      if (auto error = within(bound)) return error;
    }
  }
  if (beyond_stops_rad(c.arm, c.reset_pose_rad) > c.stop_tolerance_rad) {
    return bad("reset_pose_rad", c.reset_pose_rad[1] - c.reset_pose_rad[2], "within the stops of q2 - q3");
  }
  return std::nullopt;
}

}  // namespace hapticd::phantom
