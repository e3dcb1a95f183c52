#pragma once

#include <map>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "hal/error.h"
#include "hal/rig.h"

namespace hapticd::sim {

/// Disturbances of a real laboratory: a sensor that drifts, a table that shakes, late ticks. Each parameter
/// is off at zero; all of them are reported, and each can be set by its name (see condition_fields()).
struct Conditions {
  // Sensor. Each axis of the zero moves at this rate, back and forth within the bound; torque with it.
  double sensor_drift_n_per_s = 0.0;
  double sensor_drift_bound_n = 0.05;
  double sensor_drift_wanders = 0.0;  ///< 1: random walk of that typical rate instead of a ramp
  double sensor_step_n = 0.0;         ///< the zero jumps by this …
  double sensor_step_interval_s = 5.0;
  double sensor_crosstalk_share = 0.0;  ///< of each axis in the two others
  double sensor_noise_n = 0.0;      ///< besides its own: standard deviation of a mean over 1 ms, each axis
  double sensor_frozen_at_s = 0.0;  ///< from then on every sample repeats the same reading; 0 = never
  double bias_error_x_n = 0.0;      ///< load on the sensor when it was biased
  double bias_error_y_n = 0.0;
  double bias_error_z_n = 0.0;
  double sensor_delay_ms = 0.0;   ///< age of the newest sensor sample
  double encoder_delay_ms = 0.0;  ///< age of the encoders' reading
  double delays_reported = 0.0;   ///< 1: the samples' ages contain the delays; 0: the rig does not know them
  // Ticks; in virtual time only: real ticks have their own delays.
  double late_tick_share = 0.0;    ///< of all ticks …
  double late_tick_ms = 0.5;       ///< … are late by this on average (exponential)
  double stall_interval_s = 0.0;   ///< at this mean interval …
  double stall_ms = 20.0;          ///< … the loop pauses for this long
  double sensor_late_share = 0.0;  ///< of all ticks find no new sensor sample; they come with the next
  double sensor_lost_share = 0.0;  ///< of all ticks: the samples that were due are lost
  // Table.
  double vibration_m_per_s2 = 0.0;  ///< peak acceleration of the base
  double vibration_low_hz = 5.0;    ///< each knock has its own frequency between these
  double vibration_high_hz = 60.0;
  double vibration_interval_s = 3.0;  ///< between knocks; 0 = continuous vibration
  // Device. 1 + anisotropy along x, 1 - anisotropy along z; and a smooth variation over the workspace.
  double mass_anisotropy_share = 0.0;
  double mass_pose_share = 0.0;
  double friction_anisotropy_share = 0.0;
  double friction_pose_share = 0.0;
  // Tool.
  double tool_mass_error_share = 0.0;  ///< true mass divided by the reported one, minus 1
  double tool_tilt_deg = 0.0;          ///< rotation of the tool after biasing, about x …
  double tool_tilt_at_s = 0.0;         ///< … from this time on
  double orientation_error_deg = 0.0;  ///< of the orientation reading, about x
  // Arm: standard deviations of what the seed draws, and what bends or plays. See hidden_arm.h.
  double joint_gain_error_share = 0.0;
  double joint_offset_error_deg = 0.0;
  double link_error_mm = 0.0;
  double joint_ripple_deg = 0.0;  ///< amplitude of a wave in each joint's angle, as eccentric drums make it
  double gimbal_gain_error_share = 0.0;
  double gimbal_offset_error_deg = 0.0;
  double gimbal_play_deg = 0.0;  ///< of each axis, from stop to stop
  double arm_sag_mm = 0.0;       ///< by which the tip hangs lower where the arm is level and stretched
  // Tracker: a visual system that sees a marker on the tool; see simulated_tracker.h.
  double tracker_rate_hz = 0.0;  ///< 0 = there is none
  double tracker_noise_mm = 0.3;
  double tracker_noise_deg = 0.15;
  double tracker_latency_ms = 0.0;       ///< by which its stamps are later than what it saw
  double tracker_jitter_ms = 0.0;        ///< of its stamps, standard deviation
  double tracker_outlier_share = 0.0;    ///< of its poses are elsewhere
  double tracker_dropout_share = 0.0;    ///< of its poses are missing, a quarter of a second at a time
  double tracker_marker_mm = 60.0;       ///< from the tip to the marker
  double tracker_positions_only = 0.0;   ///< 1: it sees no orientation
  double tracker_clock_offset_s = 0.0;   ///< its clock less the rig's
  double tracker_clock_drift_ppm = 0.0;  ///< its clock gains
  double tracker_clock_jump_ms = 0.0;    ///< its clock jumps by this …
  double tracker_clock_jump_at_s = 10.0;
  double tracker_frozen_at_s = 0.0;   ///< from then on it sends the same pose; 0 = never
  double tracker_unit_scale = 1.0;    ///< 0.001: it sends metres
  double tracker_mirrored = 0.0;      ///< 1: its frame is left-handed, x reversed
  double tracker_axes_swapped = 0.0;  ///< 1: it sends y, x, z

  /// Makes every tick and every sensor sample even.
  void ticks_are_even() noexcept {
    late_tick_share = stall_interval_s = sensor_late_share = sensor_lost_share = 0.0;
  }
};

/// One parameter of Conditions: its name is the member's.
struct ConditionField {
  std::string_view name;
  double Conditions::*value;
  double low;
  double high;
  std::string_view unit;
  double lab;  ///< in the preset "lab"
  std::string_view source;
  double arm = 0.0;  ///< in the preset "arm": an arm that was never calibrated
};

std::span<const ConditionField> condition_fields();

/// "clean", "lab" or "arm", with single parameters overridden by name. Unknown names and values out of range
/// are refused.
hal::Result<Conditions> conditions_of(const std::string& preset,
                                      const std::map<std::string, double>& values = {});
std::vector<std::string> condition_preset_names();

/// The active ones, for the report of a rig.
std::vector<hal::UncertainParameter> uncertain(const Conditions& conditions);

}  // namespace hapticd::sim
