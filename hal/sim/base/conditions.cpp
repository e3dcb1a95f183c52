#include "hal/sim/base/conditions.h"

#include <algorithm>
#include <array>

#include "hal/shown_text.h"

namespace hapticd::sim {

namespace {

using C = Conditions;

// The lab's values: what a careful laboratory has to expect on an ordinary day. Values without a known
// source are assumed, and so are the figures that depend on them.
constexpr std::array kFields{
    ConditionField{"sensor_drift_n_per_s", &C::sensor_drift_n_per_s, 0.0, 0.01, "N/s", 1e-3,
                   "assumed: a Nano17 that warms up in a hand; observed on such sensors within minutes"},
    ConditionField{"sensor_drift_bound_n", &C::sensor_drift_bound_n, 0.0, 1.0, "N", 0.05, "assumed"},
    ConditionField{"sensor_drift_wanders", &C::sensor_drift_wanders, 0.0, 1.0, "1", 1.0,
                   "1: random walk, 0: ramp"},
    ConditionField{"sensor_step_n", &C::sensor_step_n, 0.0, 5.0, "N", 0.0,
                   "assumed: someone pulls the cable"},
    ConditionField{"sensor_step_interval_s", &C::sensor_step_interval_s, 0.01, 3600.0, "s", 5.0, "assumed"},
    ConditionField{"sensor_crosstalk_share", &C::sensor_crosstalk_share, 0.0, 0.1, "1", 0.01,
                   "data sheet: error within 1 … 1.75 % of full scale"},
    ConditionField{"sensor_noise_n", &C::sensor_noise_n, 0.0, 0.1, "N", 0.0,
                   "assumed: a long cable, or motors that the amplifier hears"},
    ConditionField{"sensor_frozen_at_s", &C::sensor_frozen_at_s, 0.0, 3600.0, "s", 0.0,
                   "0 = it never freezes"},
    ConditionField{"bias_error_x_n", &C::bias_error_x_n, -1.0, 1.0, "N", 0.0, "load during biasing"},
    ConditionField{"bias_error_y_n", &C::bias_error_y_n, -1.0, 1.0, "N", 0.0, "load during biasing"},
    ConditionField{"bias_error_z_n", &C::bias_error_z_n, -1.0, 1.0, "N", 0.0, "load during biasing"},
    ConditionField{"sensor_delay_ms", &C::sensor_delay_ms, 0.0, 5.0, "ms", 0.4,
                   "assumed: conversion, low-pass and network of a Net F/T box"},
    ConditionField{"encoder_delay_ms", &C::encoder_delay_ms, 0.0, 5.0, "ms", 0.0, "assumed"},
    ConditionField{"delays_reported", &C::delays_reported, 0.0, 1.0, "1", 0.0,
                   "1: the samples' ages contain the delays"},
    ConditionField{
        "late_tick_share", &C::late_tick_share, 0.0, 1.0, "1", 0.02,
        "recorded on a shared machine: 1 % of the ticks are more than 20 µs late, 0.1 % 0.15 … 0.5 ms"},
    ConditionField{"late_tick_ms", &C::late_tick_ms, 0.0, 200.0, "ms", 0.3, "the same recordings"},
    ConditionField{"stall_interval_s", &C::stall_interval_s, 0.0, 3600.0, "s", 20.0, "the same recordings"},
    ConditionField{"stall_ms", &C::stall_ms, 0.0, 500.0, "ms", 8.0,
                   "the same recordings: 8 ms idle, 31 ms loaded"},
    ConditionField{"sensor_late_share", &C::sensor_late_share, 0.0, 1.0, "1", 1e-3,
                   "recorded: 0.3 … 0.9 per thousand of the ticks found no sensor record"},
    ConditionField{"sensor_lost_share", &C::sensor_lost_share, 0.0, 1.0, "1", 0.0,
                   "assumed: a cable loses nothing"},
    ConditionField{"vibration_m_per_s2", &C::vibration_m_per_s2, 0.0, 10.0, "m/s²", 0.2,
                   "assumed: steps and doors"},
    ConditionField{"vibration_low_hz", &C::vibration_low_hz, 1.0, 200.0, "Hz", 5.0, "assumed: a table"},
    ConditionField{"vibration_high_hz", &C::vibration_high_hz, 1.0, 200.0, "Hz", 60.0, "assumed: a table"},
    ConditionField{"vibration_interval_s", &C::vibration_interval_s, 0.0, 3600.0, "s", 3.0, "assumed"},
    ConditionField{"mass_anisotropy_share", &C::mass_anisotropy_share, 0.0, 0.3, "1", 0.15,
                   "assumed: a serial arm's inertia differs by direction"},
    ConditionField{"mass_pose_share", &C::mass_pose_share, 0.0, 0.3, "1", 0.1, "assumed: and by pose"},
    ConditionField{"friction_anisotropy_share", &C::friction_anisotropy_share, 0.0, 0.5, "1", 0.25,
                   "assumed: three drives of different load"},
    ConditionField{"friction_pose_share", &C::friction_pose_share, 0.0, 0.5, "1", 0.25,
                   "assumed: cable drives"},
    ConditionField{"tool_mass_error_share", &C::tool_mass_error_share, -0.5, 0.5, "1", 0.05,
                   "assumed: a tool weighed without its screws"},
    ConditionField{"tool_tilt_deg", &C::tool_tilt_deg, -90.0, 90.0, "°", 5.0, "assumed: a hand's habit"},
    ConditionField{"tool_tilt_at_s", &C::tool_tilt_at_s, 0.0, 3600.0, "s", 0.0,
                   "start of the turn, which takes 0.5 s"},
    ConditionField{"orientation_error_deg", &C::orientation_error_deg, -20.0, 20.0, "°", 0.5,
                   "assumed: gimbal potentiometers or encoders after calibration"},
    ConditionField{"joint_gain_error_share", &C::joint_gain_error_share, 0.0, 0.05, "1", 0.0,
                   "published calibrations of the arm: about 1 %", 0.01},
    ConditionField{"joint_offset_error_deg", &C::joint_offset_error_deg, 0.0, 5.0, "°", 0.0,
                   "assumed: a reset pose found by eye", 1.0},
    ConditionField{"link_error_mm", &C::link_error_mm, 0.0, 10.0, "mm", 0.0, "assumed: assembly", 0.5},
    ConditionField{"joint_ripple_deg", &C::joint_ripple_deg, 0.0, 1.0, "°", 0.0,
                   "assumed: drums out of centre by some hundredths of a millimetre", 0.04},
    ConditionField{"gimbal_gain_error_share", &C::gimbal_gain_error_share, 0.0, 0.1, "1", 0.0,
                   "assumed: potentiometers", 0.01},
    ConditionField{"gimbal_offset_error_deg", &C::gimbal_offset_error_deg, 0.0, 10.0, "°", 0.0,
                   "assumed: potentiometers", 2.0},
    ConditionField{"gimbal_play_deg", &C::gimbal_play_deg, 0.0, 3.0, "°", 0.0, "assumed: bearings", 0.2},
    ConditionField{"arm_sag_mm", &C::arm_sag_mm, 0.0, 5.0, "mm", 0.0,
                   "assumed: a tool of 100 g on 3.5 N/mm, and the links' own weight", 0.3},
    ConditionField{"tracker_rate_hz", &C::tracker_rate_hz, 0.0, 500.0, "Hz", 0.0, "an optical tracker", 60.0},
    ConditionField{"tracker_noise_mm", &C::tracker_noise_mm, 0.0, 10.0, "mm", 0.3, "data sheets: 0.25 … 0.35",
                   0.3},
    ConditionField{"tracker_noise_deg", &C::tracker_noise_deg, 0.0, 10.0, "°", 0.15,
                   "assumed: 0.3 mm on markers 100 mm apart", 0.15},
    ConditionField{"tracker_latency_ms", &C::tracker_latency_ms, 0.0, 200.0, "ms", 0.0, "published: 10 … 40",
                   25.0},
    ConditionField{"tracker_jitter_ms", &C::tracker_jitter_ms, 0.0, 20.0, "ms", 0.0, "assumed", 0.3},
    ConditionField{"tracker_outlier_share", &C::tracker_outlier_share, 0.0, 0.5, "1", 0.0,
                   "assumed: exchanged markers", 0.01},
    ConditionField{"tracker_dropout_share", &C::tracker_dropout_share, 0.0, 0.9, "1", 0.0,
                   "assumed: the hand hides the marker", 0.03},
    ConditionField{"tracker_marker_mm", &C::tracker_marker_mm, 0.0, 300.0, "mm", 60.0, "assumed", 60.0},
    ConditionField{"tracker_positions_only", &C::tracker_positions_only, 0.0, 1.0, "1", 0.0,
                   "a tracker of single points"},
    ConditionField{"tracker_clock_offset_s", &C::tracker_clock_offset_s, -1e6, 1e6, "s", 0.0,
                   "of its own clock"},
    ConditionField{"tracker_clock_drift_ppm", &C::tracker_clock_drift_ppm, -500.0, 500.0, "ppm", 0.0,
                   "of its own clock"},
    ConditionField{"tracker_clock_jump_ms", &C::tracker_clock_jump_ms, -10000.0, 10000.0, "ms", 0.0,
                   "a clock that is set"},
    ConditionField{"tracker_clock_jump_at_s", &C::tracker_clock_jump_at_s, 0.0, 3600.0, "s", 10.0,
                   "a clock that is set"},
    ConditionField{"tracker_frozen_at_s", &C::tracker_frozen_at_s, 0.0, 3600.0, "s", 0.0,
                   "0 = it never freezes"},
    ConditionField{"tracker_unit_scale", &C::tracker_unit_scale, 1e-4, 1e4, "1", 1.0, "0.001: metres", 1.0},
    ConditionField{"tracker_mirrored", &C::tracker_mirrored, 0.0, 1.0, "1", 0.0, "1: left-handed"},
    ConditionField{"tracker_axes_swapped", &C::tracker_axes_swapped, 0.0, 1.0, "1", 0.0, "1: y, x, z"},
};

}  // namespace

std::span<const ConditionField> condition_fields() {
  return kFields;
}

std::vector<std::string> condition_preset_names() {
  return {"clean", "lab", "arm"};
}

hal::Result<Conditions> conditions_of(const std::string& preset,
                                      const std::map<std::string, double>& values) {
  Conditions conditions;
  if (preset == "lab") {
    for (const ConditionField& field : kFields) conditions.*field.value = field.lab;
  } else if (preset == "arm") {
    for (const ConditionField& field : kFields) {
      if (field.arm != 0.0) conditions.*field.value = field.arm;
    }
  } else if (preset != "clean") {
    return hal::Error::of(hal::ErrorCode::kUnknownWord, "unknown conditions", "[rig.sim] conditions", preset,
                          "clean, lab, arm", "");
  }
  for (const auto& [name, value] : values) {
    const auto field =
        std::find_if(kFields.begin(), kFields.end(), [&n = name](const auto& f) { return f.name == n; });
    if (field == kFields.end()) {
      return hal::Error::of(hal::ErrorCode::kUnknownKey, "unknown condition", "[rig.sim.conditions]", name,
                            "see hal/sim/README.md", "");
    }
    if (!(value >= field->low && value <= field->high)) {
      return hal::Error::of(hal::ErrorCode::kOutOfRange, name + " is out of range", "[rig.sim.conditions]",
                            hal::number_text(value),
                            hal::number_text(field->low) + " … " + hal::number_text(field->high) + " " +
                                std::string(field->unit),
                            "choose a value in the range");
    }
    conditions.*field->value = value;
  }
  if (conditions.vibration_high_hz < conditions.vibration_low_hz) {
    return hal::Error::of(hal::ErrorCode::kContradiction, "vibration_high_hz is below vibration_low_hz",
                          "[rig.sim.conditions]", hal::number_text(conditions.vibration_high_hz),
                          "at least " + hal::number_text(conditions.vibration_low_hz) + " Hz",
                          "raise vibration_high_hz, or lower vibration_low_hz");
  }
  return conditions;
}

std::vector<hal::UncertainParameter> uncertain(const Conditions& conditions) {
  const Conditions clean;
  std::vector<hal::UncertainParameter> all;
  for (const ConditionField& field : kFields) {
    const double value = conditions.*field.value;
    if (value == clean.*field.value && value == 0.0) continue;
    // A parameter of a disturbance that is off is not reported.
    const auto shapes = [&](std::string_view prefix, double of) {
      return of == 0.0 && field.name.starts_with(prefix);
    };
    if (shapes("sensor_drift", conditions.sensor_drift_n_per_s) ||
        shapes("sensor_step", conditions.sensor_step_n) ||
        shapes("vibration", conditions.vibration_m_per_s2) || shapes("tracker", conditions.tracker_rate_hz) ||
        shapes("late_tick", conditions.late_tick_share) || shapes("stall", conditions.stall_interval_s)) {
      continue;
    }
    all.push_back({std::string(field.name), value, std::string(field.unit), std::string(field.source)});
  }
  return all;
}

}  // namespace hapticd::sim
