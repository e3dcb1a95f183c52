#include "hal/sim/simulation_limits.h"

#include <numbers>
#include <string>
#include <vector>

#include "hal/shown_text.h"
#include "hal/sim/base/range_check.h"
#include "hal/sim/object/general_object_model.h"

namespace hapticd::sim {

std::optional<hal::Error> check(const HandProgram& p) {
  struct Range {
    const char* field;
    double value, low, high;
    const char* unit;
  };
  for (const Range& r : {Range{"force_n", p.force_n, 0.0, 30.0, "N"},
                         Range{"depth_mm", p.depth_mm, 0.0, 50.0, "mm"},
                         Range{"force_rate_n_per_s", p.force_rate_n_per_s, 0.01, 100.0, "N/s"},
                         Range{"approach_mm_per_s", p.approach_mm_per_s, 0.1, 500.0, "mm/s"},
                         Range{"speed_mm_per_s", p.speed_mm_per_s, 1.0, 1500.0, "mm/s"},
                         Range{"rate_hz", p.rate_hz, 0.05, 20.0, "Hz"},
                         Range{"hold_s", p.hold_s, -1.0, 3600.0, "s"},
                         Range{"stroke_length_mm", p.stroke_length_mm, 1.0, 150.0, "mm"},
                         Range{"mass_g", p.mass_g, 1.0, 2000.0, "g"},
                         Range{"knock_n", p.knock_n, 0.0, 20.0, "N"},
                         Range{"tap_slant_deg", p.tap_slant_deg, 0.0, 60.0, "°"},
                         Range{"grip_stiffness_scale", p.grip_stiffness_scale, 0.05, 20.0, ""},
                         Range{"grip_damping_scale", p.grip_damping_scale, 0.0, 20.0, ""},
                         Range{"tilt_deg", p.tilt_deg, 0.0, 60.0, "°"},
                         Range{"twist_deg", p.twist_deg, 0.0, 60.0, "°"},
                         Range{"place_mm.x", p.place_mm.x, -200.0, 200.0, "mm"},
                         Range{"place_mm.y", p.place_mm.y, -150.0, 150.0, "mm"},
                         Range{"place_mm.z", p.place_mm.z, -100.0, 150.0, "mm"},
                         Range{"travel_s", p.travel_s, 0.0, 60.0, "s"},
                         Range{"acceleration_m_per_s2", p.acceleration_m_per_s2, 0.1, 100.0, "m/s²"},
                         Range{"stroke_direction's length", length(p.stroke_direction), 1e-6, 1e6, ""},
                         Range{"shake_direction's length", length(p.shake_direction), 1e-6, 1e6, ""}}) {
    if (auto error = out_of_range(r.field, "hand program", r.value, r.low, r.high, r.unit)) return error;
  }
  if (p.kind == HandProgram::Kind::kScan) {
    return out_of_range("repetitions of a scan", "hand program", p.repetitions, 1.0, 10000.0, "");
  }
  return std::nullopt;
}

std::optional<hal::Error> check_structure_and_sensor(const SimulationConfig& config) {
  const auto refuse = [](const char* key, double value, const char* limit) {
    return hal::Error::of(hal::ErrorCode::kOutOfRange, std::string(key) + " is out of range", "[rig.sim]",
                          hal::number_text(value), limit, "choose a value in the range");
  };
  const double gradient = length(config.structural_gradient_per_mm);
  if (!(gradient <= 0.02)) return refuse("structural_gradient_per_mm", gradient, "0 … 0.02 1/mm");
  for (const double h : config.structural_curvature_per_mm2) {
    if (!(std::abs(h) <= 1e-3)) return refuse("structural_curvature_per_mm2", h, "-0.001 … 0.001 1/mm²");
  }
  const double centre = config.tool_centre_mm ? length(*config.tool_centre_mm) : 0.0;
  if (!(centre <= 200.0)) return refuse("tool_centre_mm", centre, "within 200 mm of the sensor");
  const double force = length(config.sensor_force_offset_n);
  if (!(force <= 10.0)) return refuse("sensor_force_offset_n", force, "0 … 10 N");
  const double torque = length(config.sensor_torque_offset_n_mm);
  if (!(torque <= 100.0)) return refuse("sensor_torque_offset_n_mm", torque, "0 … 100 N·mm");
  const hal::Quaternion& q = config.sensor_to_tool;
  const double squared = q.w * q.w + q.x * q.x + q.y * q.y + q.z * q.z;
  if (!(std::abs(squared - 1.0) <= 1e-6)) return refuse("length of sensor_to_tool", std::sqrt(squared), "1");
  return std::nullopt;
}

std::optional<hal::Error> check_custom(const SimulationConfig& config) {
  const auto refuse = [](const std::string& key, double value, const char* limit) {
    return hal::Error::of(hal::ErrorCode::kOutOfRange, key + " is out of range",
                          "custom device or object of a simulated rig", hal::number_text(value), limit,
                          "choose a value in the range");
  };
  constexpr double kMax = HUGE_VAL;
  struct Range {
    const char* key;
    double value, low, high;
    const char* limit;
  };
  std::vector<Range> ranges;
  if (const auto& device = config.custom_device) {
    ranges = {{"max_force_n", device->max_force_n, 0.1, 1e3, "0.1 … 1000 N"},
              {"apparent_mass_kg", device->apparent_mass_kg, 1e-3, 10.0, "0.001 … 10 kg"},
              {"structural_stiffness_n_per_mm", device->structural_stiffness_n_per_mm, 1e-2, 1e4,
               "0.01 … 10000 N/mm"},
              {"structural_damping", device->structural_damping, 0.0, 1.0, "0 … 1"},
              {"coulomb_friction_n", device->coulomb_friction_n, 0.0, 100.0, "0 … 100 N"},
              {"viscous_friction_n_s_per_mm", device->viscous_friction_n_s_per_mm, 0.0, 1.0, "0 … 1 N·s/mm"},
              {"amplifier_pole_hz", device->amplifier_pole_hz, 10.0, 1e5, "10 … 100000 Hz"},
              {"dac_bits", static_cast<double>(device->dac_bits), 4.0, 32.0, "4 … 32"},
              {"encoder_resolution_mm", device->encoder_resolution_mm, 1e-6, 10.0, "1e-6 … 10 mm"},
              {"command_latency_s", device->command_latency_s, 0.0, 1.5e-3, "0 … 0.0015 s"}};
  }
  if (const auto& object = config.custom_object) {
    const MaterialParameters& material = object->material;
    ranges.insert(
        ranges.end(),
        {{"stiffness_at_4n_n_per_mm", material.stiffness_at_4n_n_per_mm, 1e-3, 1e5, "0.001 … 100000 N/mm"},
         {"skin_stiffness_n_per_mm", material.skin_stiffness_n_per_mm, 0.0, kMax, "≥ 0 N/mm"},
         {"skin_viscosity_n_s_per_mm", material.skin_viscosity_n_s_per_mm, 0.0, kMax, "≥ 0 N·s/mm"},
         {"skin_depth_mm", material.skin_depth_mm, 1e-9, kMax, "> 0 mm"}});
    const GeneralMaterialParameters& general = object->general_material;
    const GeneralFrictionParameters& friction = object->general_friction;
    ranges.insert(ranges.end(),
                  {{"fading_share", general.fading_share, 0.0, 1.0, "0 … 1"},
                   {"power", general.power, 1e-3, 0.9, "0.001 … 0.9"},
                   {"strain_growth", general.strain_growth, 0.0, 10.0, "0 … 10"},
                   {"slower_when_dense", general.slower_when_dense, 1.0, 1e3, "1 … 1000"},
                   {"pore_share", general.pore_share, 0.0, 100.0, "0 … 100"},
                   {"pore_time_s", general.pore_time_s, 1e-4, 1e3, "0.0001 … 1000 s"},
                   {"pore_strain_rate_per_s", general.pore_strain_rate_per_s, 1e-6, kMax, "> 0 1/s"},
                   {"load_exponent", friction.load_exponent, 0.5, 1.5, "0.5 … 1.5"},
                   {"stiffness_exponent", friction.stiffness_exponent, 0.0, 1.0, "0 … 1"}});
    for (const SlipShare& slip : general.slips) {
      ranges.push_back({"slip share", slip.share, 0.0, 10.0, "0 … 10"});
      ranges.push_back({"slip limit", slip.limit, 1e-6, 0.5, "0.000001 … 0.5"});
    }
  }
  for (const Range& r : ranges) {
    if (!(r.value >= r.low && r.value <= r.high)) return refuse(r.key, r.value, r.limit);
  }
  return std::nullopt;
}

hal::Result<DeviceModel> device_of(const SimulationConfig& config) {
  std::optional<DeviceModel> model =
      config.custom_device ? config.custom_device : device_preset(config.device);
  if (!model) {
    return hal::Error::of(hal::ErrorCode::kUnknownWord, "unknown device", "[rig.sim] device", config.device,
                          hal::joined(device_preset_names()), "");
  }
  const auto refuse = [](const char* key, double value, const std::string& limit) {
    return hal::Error::of(hal::ErrorCode::kOutOfRange, std::string(key) + " is out of range", "[rig.sim]",
                          hal::number_text(value), limit, "choose a value in the range");
  };
  if (!(config.rate_hz >= 500.0 && config.rate_hz <= 10000.0)) {
    return refuse("rate_hz", config.rate_hz, "500 … 10000 Hz");
  }
  if (!(config.tool_mass_g >= 0.0 && config.tool_mass_g <= 500.0)) {
    return refuse("tool_mass_g", config.tool_mass_g, "0 … 500 g");
  }
  if (config.structural_mode_hz) model->structural_mode_hz = *config.structural_mode_hz;
  if (config.structural_mode_hz || config.custom_device) {
    const double lowest = std::sqrt(4e3 * model->structural_stiffness_n_per_mm / model->apparent_mass_kg) /
                          (2.0 * std::numbers::pi);
    if (!(model->structural_mode_hz >= lowest && model->structural_mode_hz <= 1000.0)) {
      return refuse("structural_mode_hz", model->structural_mode_hz,
                    hal::number_text(lowest) + " … 1000 Hz (below, mass and stiffness admit no such mode)");
    }
  }
  if (config.structural_damping) {
    if (!(*config.structural_damping >= 0.0 && *config.structural_damping <= 1.0)) {
      return refuse("structural_damping", *config.structural_damping, "0 … 1");
    }
    model->structural_damping = *config.structural_damping;
  }
  if (config.amplifier_pole_hz) {
    if (!(*config.amplifier_pole_hz >= 10.0 && *config.amplifier_pole_hz <= 1e5)) {
      return refuse("amplifier_pole_hz", *config.amplifier_pole_hz, "10 … 100000 Hz");
    }
    model->amplifier_pole_hz = *config.amplifier_pole_hz;
  }

  model->structural_field = {config.structural_gradient_per_mm, config.structural_curvature_per_mm2};
  return *model;
}

}  // namespace hapticd::sim
