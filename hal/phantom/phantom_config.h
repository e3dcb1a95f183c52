#pragma once

#include <array>
#include <numbers>
#include <optional>
#include <string>
#include <vector>

#include "hal/phantom/kinematics.h"
#include "hal/rig.h"
#include "hal/samples.h"

namespace hapticd::phantom {

inline constexpr double kRadPerDegree = std::numbers::pi / 180.0;

/// Parameters of one device. The defaults are a Premium 1.5; phantom_preset() has the others.
/// uncertain_parameters() lists the values that no data sheet gives, with their source.
struct PhantomConfig {
  std::string model = "phantom_premium_1_5";

  ArmGeometry arm{
      .first_link_mm = 215.0,
      .second_link_mm = 170.0,
      .low_rad = {-90.0 * kRadPerDegree, -124.0 * kRadPerDegree, -29.0 * kRadPerDegree},
      .high_rad = {90.0 * kRadPerDegree, 119.0 * kRadPerDegree, 214.0 * kRadPerDegree},
      .most_q2_over_q3_rad = 65.0 * kRadPerDegree,
      .most_q3_over_q2_rad = 55.0 * kRadPerDegree,
  };
  double stop_tolerance_rad = 0.05;           ///< beyond a stop by more than this, the counts are wrong
  JointAngles reset_pose_rad{0.0, 0.0, 0.0};  ///< first link level, second hanging: the pose for home()
  hal::Vector3 origin_mm{};                   ///< of the device's frame, in the rig's

  std::array<double, 3> transmission{13.3, 11.2, 11.2};  ///< turns of the motor a turn of the joint
  std::array<double, 3> encoder_counts_per_turn{4096.0, 4096.0, 4096.0};  ///< of the motor, four a line
  std::array<double, 3> encoder_sign{1.0, 1.0, 1.0};

  bool gimbal =
      false;  ///< three more encoders, after those of the joints; false: the orientation is the identity
  std::array<double, 3> gimbal_counts_per_turn{4096.0, 4096.0, 4096.0};  ///< of the gimbal's axis; signed
  std::array<double, 3> gimbal_reset_rad{0.0, 0.0, 0.0};

  std::array<double, 3> torque_constant_n_mm_per_a{23.4, 23.4, 23.4};
  std::array<double, 3> amplifier_gain_a_per_v{0.6, 0.6, 0.6};
  std::array<double, 3> motor_sign{1.0, 1.0, 1.0};
  std::array<double, 3> peak_current_a{5.51, 5.51, 5.51};        ///< 129 mN·m
  std::array<double, 3> continuous_current_a{1.15, 1.15, 1.15};  ///< 1.4 N at the reset pose
  double thermal_time_constant_s = 12.0;

  double max_force_n = 8.5;
  double max_continuous_force_n = 1.4;
  double apparent_mass_g = 75.0;
  double structural_stiffness_n_per_mm = 3.5;
  double structural_mode_hz = 0.0;  ///< lowest mode of the bare device, free; 0 = unknown
  double coulomb_friction_n = 0.04;

  double max_speed_mm_per_s = 1500.0;       ///< of the tip; faster is kDeviceOverSpeed and no force
  double max_joint_speed_rad_per_s = 60.0;  ///< faster than an arm can be: the encoder has jumped
  double watchdog_ms = 20.0;                ///< without a command: zero volts
  double home_still_ms = 100.0;             ///< how long the arm must rest in its reset pose for home()
  bool home_on_engage = false;              ///< the arm is in its reset pose before every start
};

/// The presets: "phantom_premium_1_0", "phantom_premium_1_5", "phantom_premium_1_5_high_force".
std::optional<PhantomConfig> phantom_preset(const std::string& model);
std::vector<std::string> phantom_presets();

/// The parameters that no data sheet or measurement gives, with their source. A value that differs from the
/// preset's has the source "configuration".
std::vector<hal::UncertainParameter> uncertain_parameters(const PhantomConfig& config);

/// Checks a configuration; an error names the first invalid value.
std::optional<hal::Error> check(const PhantomConfig& config);

}  // namespace hapticd::phantom
