#include "hal/sim/device/hidden_arm.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "hal/sim/base/random.h"
#include "hal/sim/base/rotation.h"

namespace hapticd::sim {

namespace {

constexpr double kRadPerDeg = std::numbers::pi / 180.0;
constexpr double kRippleTurns = 4.0;  ///< waves in a turn of the joint

double cut_normal(Random& random) noexcept {
  return std::clamp(random.normal(), -2.0, 2.0);
}

}  // namespace

HiddenArm::HiddenArm(const Arm& drawing, const Conditions& c, std::uint64_t seed) noexcept
    : drawing_(drawing),
      arm_(drawing),
      ripple_rad_(c.joint_ripple_deg * kRadPerDeg),
      half_play_rad_(0.5 * c.gimbal_play_deg * kRadPerDeg),
      sag_mm_(c.arm_sag_mm) {
  Random random(seed ^ 0x61726d5f65727273ULL);
  for (std::size_t i = 0; i < 3; ++i) {
    joint_gain_[i] += c.joint_gain_error_share * cut_normal(random);
    joint_offset_rad_[i] = c.joint_offset_error_deg * kRadPerDeg * cut_normal(random);
    gimbal_gain_[i] += c.gimbal_gain_error_share * cut_normal(random);
    gimbal_offset_rad_[i] = c.gimbal_offset_error_deg * kRadPerDeg * cut_normal(random);
  }
  arm_.first_link_mm += c.link_error_mm * cut_normal(random);
  arm_.second_link_mm += c.link_error_mm * cut_normal(random);
  for (double& phase : ripple_phase_rad_) phase = 2.0 * std::numbers::pi * random.uniform();
  exact_ = c.joint_gain_error_share == 0.0 && c.joint_offset_error_deg == 0.0 && c.link_error_mm == 0.0 &&
           c.gimbal_gain_error_share == 0.0 && c.gimbal_offset_error_deg == 0.0 && half_play_rad_ == 0.0 &&
           ripple_rad_ == 0.0 && sag_mm_ == 0.0;
}

hal::DeviceAngles HiddenArm::counted(const hal::Vector3& tip_mm, const hal::Quaternion& orientation,
                                     double step_rad) noexcept {
  // The base stays where the drawing has it; a cantilever's end hangs by the cube of its reach.
  const double base_y_mm = -drawing_.first_link_mm;
  const double base_z_mm = drawing_.second_link_mm;
  const double reach =
      std::hypot(tip_mm.x, tip_mm.y - base_y_mm) / (drawing_.first_link_mm + drawing_.second_link_mm);
  // angles_of() has the base follow the lengths.
  const Vector3 from_base{tip_mm.x, tip_mm.y - base_y_mm,
                          tip_mm.z - base_z_mm + sag_mm_ * reach * reach * reach};
  const Vector3 stiff_mm{from_base.x, from_base.y - arm_.first_link_mm, from_base.z + arm_.second_link_mm};
  hal::DeviceAngles seen = angles_of(arm_, stiff_mm, orientation);
  for (std::size_t i = 0; i < 3; ++i) {
    double& held = held_rad_[i];
    const double at = seen.gimbal_rad[i];
    held = holds_ ? std::clamp(held, at - half_play_rad_, at + half_play_rad_) : at;
    seen.gimbal_rad[i] = (held - gimbal_offset_rad_[i]) / gimbal_gain_[i];
    const double ripple_rad = ripple_rad_ * std::sin(kRippleTurns * seen.joint_rad[i] + ripple_phase_rad_[i]);
    const double joint_rad = (seen.joint_rad[i] + ripple_rad - joint_offset_rad_[i]) / joint_gain_[i];
    seen.joint_rad[i] = std::round(joint_rad / step_rad) * step_rad;
  }
  holds_ = true;
  return seen;
}

Vector3 HiddenArm::reported_tip_mm(const hal::DeviceAngles& a) const noexcept {
  const double reach_mm =
      drawing_.first_link_mm * std::cos(a.joint_rad[1]) + drawing_.second_link_mm * std::sin(a.joint_rad[2]);
  return {-reach_mm * std::sin(a.joint_rad[0]), reach_mm * std::cos(a.joint_rad[0]) - drawing_.first_link_mm,
          drawing_.first_link_mm * std::sin(a.joint_rad[1]) -
              drawing_.second_link_mm * std::cos(a.joint_rad[2]) + drawing_.second_link_mm};
}

hal::Quaternion HiddenArm::reported_orientation(const hal::DeviceAngles& a) const noexcept {
  constexpr double kQuarter = 0.5 * std::numbers::pi;
  hal::Quaternion q = rotation({0.0, 0.0, kQuarter + a.joint_rad[0]});
  for (const Vector3& turn : {Vector3{0.0, -a.joint_rad[2], 0.0}, Vector3{0.0, 0.0, a.gimbal_rad[0]},
                              Vector3{0.0, a.gimbal_rad[1], 0.0}, Vector3{a.gimbal_rad[2], 0.0, 0.0},
                              Vector3{0.0, 0.0, -kQuarter}}) {
    q = composed(q, rotation(turn));
  }
  return q;
}

}  // namespace hapticd::sim
