#include "server/rig_file/phantom_section.h"

#include <fmt/format.h>

#include <array>

#include "server/text/suggestion.h"
#include "server/text/toml_text.h"

namespace hapticd::server {

namespace {

using phantom::PhantomConfig;

/// A key with one number.
struct Single {
  const char* key = nullptr;
  double& (*of)(PhantomConfig&) = nullptr;
  Range range;
};
constexpr Single kSingles[] = {
    {"first_link_mm", [](PhantomConfig& c) -> double& { return c.arm.first_link_mm; }, {10.0, 2000.0, "mm"}},
    {"second_link_mm",
     [](PhantomConfig& c) -> double& { return c.arm.second_link_mm; },
     {10.0, 2000.0, "mm"}},
    {"most_q2_over_q3_rad",
     [](PhantomConfig& c) -> double& { return c.arm.most_q2_over_q3_rad; },
     {0.0, 1.5, "rad"}},
    {"most_q3_over_q2_rad",
     [](PhantomConfig& c) -> double& { return c.arm.most_q3_over_q2_rad; },
     {0.0, 1.5, "rad"}},
    {"stop_tolerance_rad",
     [](PhantomConfig& c) -> double& { return c.stop_tolerance_rad; },
     {0.0, 1.0, "rad"}},
    {"thermal_time_constant_s",
     [](PhantomConfig& c) -> double& { return c.thermal_time_constant_s; },
     {0.1, 1e4, "s"}},
    {"max_force_n", [](PhantomConfig& c) -> double& { return c.max_force_n; }, {0.01, 1000.0, "N"}},
    {"max_continuous_force_n",
     [](PhantomConfig& c) -> double& { return c.max_continuous_force_n; },
     {0.001, 1000.0, "N"}},
    {"apparent_mass_g", [](PhantomConfig& c) -> double& { return c.apparent_mass_g; }, {1.0, 1e4, "g"}},
    {"structural_stiffness_n_per_mm",
     [](PhantomConfig& c) -> double& { return c.structural_stiffness_n_per_mm; },
     {0.0, 1e6, "N/mm"}},
    {"coulomb_friction_n",
     [](PhantomConfig& c) -> double& { return c.coulomb_friction_n; },
     {0.0, 100.0, "N"}},
    {"max_speed_mm_per_s",
     [](PhantomConfig& c) -> double& { return c.max_speed_mm_per_s; },
     {1.0, 1e5, "mm/s"}},
    {"max_joint_speed_rad_per_s",
     [](PhantomConfig& c) -> double& { return c.max_joint_speed_rad_per_s; },
     {0.1, 1e4, "rad/s"}},
    {"watchdog_ms", [](PhantomConfig& c) -> double& { return c.watchdog_ms; }, {1.0, 1000.0, "ms"}},
    {"home_still_ms", [](PhantomConfig& c) -> double& { return c.home_still_ms; }, {0.0, 10'000.0, "ms"}},
};

/// A key with one number for each joint, or for each axis of the gimbal.
struct Triple {
  const char* key = nullptr;
  std::array<double, 3>& (*of)(PhantomConfig&) = nullptr;
  Range range;
};
using Three = std::array<double, 3>;
constexpr Triple kTriples[] = {
    {"joint_low_rad", [](PhantomConfig& c) -> Three& { return c.arm.low_rad; }, {-6.3, 6.3, "rad"}},
    {"joint_high_rad", [](PhantomConfig& c) -> Three& { return c.arm.high_rad; }, {-6.3, 6.3, "rad"}},
    {"reset_pose_rad", [](PhantomConfig& c) -> Three& { return c.reset_pose_rad; }, {-6.3, 6.3, "rad"}},
    {"transmission", [](PhantomConfig& c) -> Three& { return c.transmission; }, {0.1, 1000.0, ""}},
    {"encoder_counts_per_turn",
     [](PhantomConfig& c) -> Three& { return c.encoder_counts_per_turn; },
     {4.0, 1e8, ""}},
    {"encoder_sign", [](PhantomConfig& c) -> Three& { return c.encoder_sign; }, {-1.0, 1.0, ""}},
    {"gimbal_counts_per_turn",
     [](PhantomConfig& c) -> Three& { return c.gimbal_counts_per_turn; },
     {-1e8, 1e8, ""}},
    {"gimbal_reset_rad", [](PhantomConfig& c) -> Three& { return c.gimbal_reset_rad; }, {-6.3, 6.3, "rad"}},
    {"torque_constant_n_mm_per_a",
     [](PhantomConfig& c) -> Three& { return c.torque_constant_n_mm_per_a; },
     {0.01, 1e5, "N·mm/A"}},
    {"amplifier_gain_a_per_v",
     [](PhantomConfig& c) -> Three& { return c.amplifier_gain_a_per_v; },
     {1e-4, 1e4, "A/V"}},
    {"motor_sign", [](PhantomConfig& c) -> Three& { return c.motor_sign; }, {-1.0, 1.0, ""}},
    {"peak_current_a", [](PhantomConfig& c) -> Three& { return c.peak_current_a; }, {1e-3, 1e3, "A"}},
    {"continuous_current_a",
     [](PhantomConfig& c) -> Three& { return c.continuous_current_a; },
     {1e-4, 1e3, "A"}},
};
constexpr Range kOriginMm{-1e5, 1e5, "mm"};

std::string numbers(const Three& values) {
  return fmt::format("[{}, {}, {}]", toml_number(values[0]), toml_number(values[1]), toml_number(values[2]));
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
  for (const Single& single : kSingles) table.read(single.key, single.of(config), single.range);
  for (const Triple& triple : kTriples) table.read(triple.key, triple.of(config), triple.range);
  table.read("origin_mm", config.origin_mm, kOriginMm);
  table.read("gimbal", config.gimbal);
  table.read("home_on_engage", config.home_on_engage);
}

std::string write_phantom(const PhantomConfig& config) {
  PhantomConfig copy = config;  // the tables of keys are made for reading
  std::string text = fmt::format("model = {}\n", toml_quoted(config.model));
  for (const Single& single : kSingles) {
    text += fmt::format("{} = {}\n", single.key, toml_number(single.of(copy)));
  }
  for (const Triple& triple : kTriples)
    text += fmt::format("{} = {}\n", triple.key, numbers(triple.of(copy)));
  text +=
      fmt::format("origin_mm = {}\n", numbers({config.origin_mm.x, config.origin_mm.y, config.origin_mm.z}));
  text += fmt::format("gimbal = {}\nhome_on_engage = {}\n", config.gimbal, config.home_on_engage);
  return text;
}

}  // namespace hapticd::server
