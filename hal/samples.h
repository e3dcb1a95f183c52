#pragma once

#include <array>
#include <cmath>
#include <cstdint>
#include <type_traits>

namespace hapticd::hal {

/// Three components; frame and unit are given where it is used. Plain, so that it may cross threads by
/// memcpy.
struct Vector3 {
  double x = 0.0;
  double y = 0.0;
  double z = 0.0;
};

constexpr Vector3 operator+(const Vector3& a, const Vector3& b) noexcept {
  return {a.x + b.x, a.y + b.y, a.z + b.z};
}
constexpr Vector3 operator-(const Vector3& a, const Vector3& b) noexcept {
  return {a.x - b.x, a.y - b.y, a.z - b.z};
}
constexpr Vector3 operator*(const Vector3& a, double s) noexcept {
  return {a.x * s, a.y * s, a.z * s};
}
inline bool finite(const Vector3& v) noexcept {
  return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z);
}
constexpr double dot(const Vector3& a, const Vector3& b) noexcept {
  return a.x * b.x + a.y * b.y + a.z * b.z;
}

/// Unit quaternion, Hamilton convention, rotating tool coordinates into rig coordinates.
struct Quaternion {
  double w = 1.0;
  double x = 0.0;
  double y = 0.0;
  double z = 0.0;
};

/// What the drivers know to be wrong with a sample. Zero means fit for use; what
/// each leads to is in the table of faults (rt/guard).
namespace sample_status {
inline constexpr std::uint32_t kForceMissing = 1U << 0;     ///< no sensor sample arrived since the last tick
inline constexpr std::uint32_t kForceSaturated = 1U << 1;   ///< at least one channel at its end of range
inline constexpr std::uint32_t kForceFault = 1U << 2;       ///< the sensor reports a fault
inline constexpr std::uint32_t kDeviceFault = 1U << 3;      ///< the device is lost or reports an error
inline constexpr std::uint32_t kForceLost = 1U << 4;        ///< no connection to the sensor
inline constexpr std::uint32_t kForceWarning = 1U << 5;     ///< the sensor reports a condition, but is usable
inline constexpr std::uint32_t kDeviceNotReady = 1U << 6;   ///< not calibrated, homed or engaged
inline constexpr std::uint32_t kDeviceWarm = 1U << 7;       ///< motors near their thermal limit
inline constexpr std::uint32_t kDeviceOverForce = 1U << 8;  ///< the command exceeded the limit of the device
inline constexpr std::uint32_t kDeviceOverSpeed = 1U << 9;  ///< the device moves faster than allowed
inline constexpr std::uint32_t kCommandStale = 1U
                                               << 10;  ///< no command came in time; the device cut the force
}  // namespace sample_status

/// Angles of a device's joints and of its gimbal as the device counts them: zero and sense are its own.
struct DeviceAngles {
  std::array<double, 3> joint_rad{};
  std::array<double, 3> gimbal_rad{};
  bool known = false;  ///< false: the device does not report them
};

/// One tick's measurement. Rig frame: right-handed, z up, millimetres.
struct RigSample {
  std::uint64_t tick = 0;    ///< counts from 0 at the start of the rig, one a period
  std::int64_t time_ns = 0;  ///< the rig's own clock (virtual, recorded or monotonic), from its start
  Vector3 tip_position_mm;   ///< tool tip from the encoders; does not contain structural deflection
  Quaternion tip_orientation;
  DeviceAngles angles;
  Vector3 sensor_force_n;      ///< tool frame, force *on* the tool; mean since the last tick; includes tool
                               ///< inertia and the change of its gravity since the sensor was biased
  Vector3 sensor_torque_n_mm;  ///< tool frame, about the sensor's origin
  std::uint32_t force_count = 0;  ///< sensor samples in the mean
  std::uint32_t status = 0;       ///< bits of sample_status
  std::int64_t force_age_ns = 0;  ///< age of the newest sensor sample at time_ns
  /// Age of sensor_force_n at time_ns: counts from the middle of the samples in the mean.
  std::int64_t force_mean_age_ns = 0;
  std::int64_t position_age_ns = 0;  ///< age of the encoders' reading at time_ns
  /// Serial number of the sensor's zero: changes with every bias, and when the zero was lost (box restarted,
  /// other calibration).
  std::uint32_t bias_serial = 0;
  /// Force that the device can give in this pose in every direction, N; 0 = as in DeviceInfo.
  double max_force_n = 0.0;
};

/// Command for the device until the next tick: a force on the tool tip, rig frame.
struct DeviceCommand {
  Vector3 force_n;
};

/// The ground truth of a sample. Only a simulated rig has one; the rendering must not read it.
struct TruthSample {
  Vector3 tip_position_mm;        ///< true position of the tip
  Vector3 hand_force_n;           ///< force of the hand on the tool, rig frame
  Vector3 reaction_force_n;       ///< force of the object on the tip, rig frame
  Vector3 device_force_n;         ///< force of the motors at the motor side, after lag and quantisation
  Vector3 undeformed_contact_mm;  ///< nearest point of the undeformed surface
  Vector3 outward_normal;         ///< surface normal there, pointing out of the object
  double displacement_mm = 0.0;   ///< depth of the tip below the undeformed surface, 0 when outside
  double normal_force_n = 0.0;    ///< elastic and viscous part of the reaction, ≥ 0
  double friction_force_n = 0.0;  ///< magnitude of the tangential part
  double surface_depression_mm =
      0.0;  ///< depth of the surface itself; not zero after contact while it recovers
  bool in_contact = false;
};

static_assert(std::is_trivially_copyable_v<RigSample>);
static_assert(std::is_trivially_copyable_v<DeviceCommand>);
static_assert(std::is_trivially_copyable_v<TruthSample>);

}  // namespace hapticd::hal
