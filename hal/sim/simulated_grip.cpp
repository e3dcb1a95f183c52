#include <algorithm>
#include <cmath>
#include <numbers>

#include "hal/sim/base/rotation.h"
#include "hal/sim/simulation.h"

namespace hapticd::sim {

// How the hand holds the tool, and what the sensor in it bears.

namespace {

constexpr double kTremorMm = 0.03;
constexpr double kWobbleRad = 0.005;
constexpr double kSwayAboutXHz = 0.35;
constexpr double kSwayAboutYHz = 0.45;
constexpr double kSwayAboutZHz = 0.29;
constexpr double kTiltTakesS = 0.5;

}  // namespace

Vector3 Simulation::tremor(double time_s) const noexcept {
  const auto wave = [&](double hz, std::size_t phase) {
    return std::sin(2.0 * std::numbers::pi * hz * time_s + tremor_phase_[phase]);
  };
  return {0.5 * kTremorMm * wave(8.3, 0), 0.5 * kTremorMm * wave(9.1, 1),
          0.5 * kTremorMm * (wave(8.7, 2) + wave(10.3, 3))};
}

// Rotation vector of the tilt that the hand means to give the tool. It grows out of where the hand before
// left it: from upright, unless that one swayed too.
Vector3 Simulation::sway(double hand_time_s) const noexcept {
  const double grown =
      MinimumJerk({}, {1.0, 0.0, 0.0}, kSwayBuildsUpS).at(std::min(hand_time_s, kSwayBuildsUpS)).position_mm;
  const double amplitude_rad = grown * hand_->program.tilt_deg * std::numbers::pi / 180.0;
  const double twist_rad = grown * hand_->program.twist_deg * std::numbers::pi / 180.0;
  const double turn = 2.0 * std::numbers::pi * hand_time_s;
  const double ends_s = std::min(hand_time_s, kSwayBuildsUpS);
  // If the tool's mass hangs next to the tip, a wrist that stopped within a step would be a blow.
  const Vector3 left_rad =
      plain_mounting_ ? sway_before_rad_ * (1.0 - grown)
                      : Vector3{sway_ends_[0].at(ends_s).position_mm, sway_ends_[1].at(ends_s).position_mm,
                                sway_ends_[2].at(ends_s).position_mm};
  return left_rad + Vector3{amplitude_rad * std::sin(kSwayAboutXHz * turn),
                            amplitude_rad * std::sin(kSwayAboutYHz * turn),
                            twist_rad * std::sin(kSwayAboutZHz * turn)};
}

hal::Quaternion Simulation::tool_orientation(double time_s) const noexcept {
  const Vector3 wobble{kWobbleRad * std::sin(2.0 * time_s + tremor_phase_[0]),
                       kWobbleRad * std::sin(2.6 * time_s + tremor_phase_[1]), 0.0};
  const hal::Quaternion held = composed(rotation(sway(hand_time_s())), rotation(wobble));
  return conditions_.tool_tilt_deg == 0.0 ? held : composed(rotation({tilt_rad(time_s), 0.0, 0.0}), held);
}

double Simulation::tilt_rad(double time_s) const noexcept {
  const double tilt = conditions_.tool_tilt_deg * std::numbers::pi / 180.0;
  if (conditions_.tool_tilt_at_s <= 0.0) return tilt;
  const double since_s = std::clamp(time_s - conditions_.tool_tilt_at_s, 0.0, kTiltTakesS);
  return MinimumJerk({}, {tilt, 0.0, 0.0}, kTiltTakesS).at(since_s).position_mm;
}

// Loads the sensor: what the object gives, less what it takes to accelerate the tool, plus its weight.
void Simulation::load_sensor(const Vector3& acceleration, double time_s) noexcept {
  const Vector3 gravity{0.0, 0.0, -kGravityMmPerS2};
  if (!plain_mounting_) {
    orientation_ = tool_orientation(time_s);
    Vector3 of_centre = acceleration;
    if (mounting_.centre_mm) {
      // The mass is carried round the tip as the tool turns; the sensor's origin is a lever above the tip.
      const Vector3 arm = *mounting_.centre_mm + Vector3{0.0, 0.0, Nano17::kLeverMm};
      const Vector3 now = to_tool(inverse(orientation_), arm);
      if (centres_known_ == 2) {
        of_centre = of_centre +
                    (now - centre_before_mm_[0] * 2.0 + centre_before_mm_[1]) * (1.0 / (step_s_ * step_s_));
      } else {
        ++centres_known_;
      }
      centre_before_mm_ = {now, centre_before_mm_[0]};
    }
    const Vector3 tool_n = to_tool(orientation_, (gravity - of_centre) * (1e-3 * tool_mass_kg_));
    const Vector3 reaction_n = to_tool(orientation_, truth_.reaction_force_n);
    const Vector3 tip_mm{0.0, 0.0, -Nano17::kLeverMm};
    const Vector3 torque_n_mm =
        cross(tip_mm, reaction_n) + cross(mounting_.centre_mm.value_or(tip_mm), tool_n);
    sensor_.measure(to_tool(mounting_.sensor_to_tool, reaction_n + tool_n),
                    to_tool(mounting_.sensor_to_tool, torque_n_mm));
    return;
  }
  const bool sways = hand_->program.tilt_deg > 0.0 || hand_->program.twist_deg > 0.0 ||
                     dot(sway_before_rad_, sway_before_rad_) > 0.0 || conditions_.tool_tilt_deg != 0.0;
  if (sways || steps_ % slow_steps_ == 0) orientation_ = tool_orientation(time_s);
  sensor_.measure(
      to_tool(orientation_, truth_.reaction_force_n + (gravity - acceleration) * (1e-3 * tool_mass_kg_)));
}

}  // namespace hapticd::sim
