#pragma once

#include "hal/samples.h"
#include "rt/signal/tool_compensation.h"
#include "rt/signal/vector.h"

namespace hapticd::rt {

/// How the sensor sits in the tool and what it reads of nothing: a load in tool coordinates is turn (raw -
/// bias), the turn given by its axis times its angle.
struct SensorMounting {
  hal::Vector3 turn_deg;
  hal::Vector3 force_bias_n;

  /// Turn as a rotation.
  hal::Quaternion to_tool() const noexcept {
    constexpr double kHalfRadPerDeg = 0.00872664625997164788;
    const double angle_deg = norm(turn_deg);
    const double half = kHalfRadPerDeg * angle_deg;
    const double s = angle_deg > 0.0 ? std::sin(half) / angle_deg : 0.0;
    return {std::cos(half), turn_deg.x * s, turn_deg.y * s, turn_deg.z * s};
  }
};

/// Shorter of the two turns that a rotation is.
inline hal::Vector3 turn_deg_of(const hal::Quaternion& rotation) noexcept {
  constexpr double kDegPerHalfRad = 114.59155902616464;
  hal::Quaternion q = unit(rotation);
  if (q.w < 0.0) q = {-q.w, -q.x, -q.y, -q.z};
  const hal::Vector3 axis{q.x, q.y, q.z};
  const double s = norm(axis);
  return s > 0.0 ? axis * (kDegPerHalfRad * std::atan2(s, q.w) / s) : hal::Vector3{};
}

/// Weight and inertia of the tool in any orientation, (4.5)-(4.8).
///
/// The sensor, biased with the tool hanging still, reads in tool coordinates
///   f_s = Tᵀ (f_r + m (g - a)) - m g_0,
/// with T the tool's rotation, g gravity in the rig frame and g_0 gravity as the tool saw it when the sensor
/// was biased (4.6). a is the acceleration of the mass's centre: where the tool turns about its tip, the
/// centre's is another than the tip's, and so are its weight and inertia complete; what the mass resists
/// turning with is a torque, which no force shows. All in rig coordinates below; a 1° error of orientation
/// costs m G · 0.017 (2 mN for 12.6 g).
class ToolLoad {
 public:
  static constexpr double kGravityMmPerS2 = 9807.0;  // (4.6)

  /// `gravity_at_bias`: unit vector, tool frame.
  ToolLoad(double mass_g, const hal::Vector3& gravity_at_bias) noexcept
      : mass_g_(mass_g),
        weight_n_{0.0, 0.0, -inertial_force_n(mass_g, kGravityMmPerS2)},
        offset_n_(gravity_at_bias * inertial_force_n(mass_g, kGravityMmPerS2)) {}
  /// Load for a sensor whose bias and seat are known; nothing was taken as zero.
  static ToolLoad mounted(double mass_g, const SensorMounting& mounting) noexcept {
    ToolLoad load(mass_g, hal::Vector3{});
    load.is_turned_ = norm(mounting.turn_deg) > 0.0;
    load.to_tool_ = mounting.to_tool();
    load.offset_n_ = rotated(load.to_tool_, mounting.force_bias_n) * -1.0;
    return load;
  }

  /// f_r - m a, rig frame: what is left when weight is subtracted ((4.5) without its inertia).
  hal::Vector3 without_weight_n(const hal::RigSample& sample) const noexcept {
    return without_weight_n(sample.sensor_force_n, sample.tip_orientation);
  }
  hal::Vector3 without_weight_n(const hal::Vector3& sensor_force_n,
                                const hal::Quaternion& orientation) const noexcept {
    const hal::Vector3 raw_n = is_turned_ ? rotated(to_tool_, sensor_force_n) : sensor_force_n;
    return rotated(unit(orientation), raw_n + offset_n_) - weight_n_;
  }
  /// Force of the rig frame as the sensor would read it.
  hal::Vector3 in_sensor_frame(const hal::Vector3& force_n,
                               const hal::Quaternion& orientation) const noexcept {
    const hal::Vector3 in_tool = rotated(conjugate(unit(orientation)), force_n);
    return is_turned_ ? rotated(conjugate(to_tool_), in_tool) : in_tool;
  }
  /// Vector of the sensor's frame in that of the rig.
  hal::Vector3 in_rig_frame(const hal::Vector3& v, const hal::Quaternion& orientation) const noexcept {
    return rotated(unit(orientation), is_turned_ ? rotated(to_tool_, v) : v);
  }
  /// Takes note that the sensor was biased with the tool held so: its weight there reads as zero from now on.
  void biased_at(const hal::Quaternion& orientation) noexcept {
    offset_n_ = rotated(conjugate(unit(orientation)), weight_n_);
  }
  /// Sets the vector from the tip to the centre of the tool's mass, tool frame.
  void set_tip_to_centre(const hal::Vector3& tip_to_centre_mm) noexcept {
    tip_to_centre_mm_ = tip_to_centre_mm;
  }
  /// Centre of the tool's mass, rig frame.
  hal::Vector3 centre_mm(const hal::Vector3& tip_mm, const hal::Quaternion& orientation) const noexcept {
    return tip_mm + rotated(unit(orientation), tip_to_centre_mm_);
  }
  /// m a (4.7), a of the mass's centre.
  hal::Vector3 inertia_n(const hal::Vector3& acceleration_mm_per_s2) const noexcept {
    return acceleration_mm_per_s2 * inertial_force_n(mass_g_, 1.0);
  }

 private:
  double mass_g_;
  hal::Vector3 weight_n_;
  hal::Vector3 tip_to_centre_mm_;
  bool is_turned_ = false;
  hal::Quaternion to_tool_;
  hal::Vector3 offset_n_;  ///< tool frame: what is added to a reading to make it the load with its weight
};

}  // namespace hapticd::rt
