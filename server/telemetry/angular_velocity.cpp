#include "server/telemetry/angular_velocity.h"

#include <cmath>

#include "hal/geometry.h"

namespace hapticd::server {

namespace {

/// The shortest turn that a rotation is, as a vector: its length the angle.
hal::Vector3 turn_rad(hal::Quaternion q) noexcept {
  if (q.w < 0.0) q = {-q.w, -q.x, -q.y, -q.z};
  const hal::Vector3 axis{q.x, q.y, q.z};
  const double sine = geometry::norm(axis);
  return sine < 1e-12 ? axis * 2.0 : axis * (2.0 * std::atan2(sine, q.w) / sine);
}

}  // namespace

hal::Vector3 AngularVelocity::follow(const hal::Quaternion& orientation, std::int64_t time_ns) noexcept {
  if (!std::isfinite(orientation.w + orientation.x + orientation.y + orientation.z)) return rad_per_s_;
  const hal::Quaternion now = geometry::unit(orientation);
  const double interval_s = 1e-9 * static_cast<double>(time_ns - last_ns_);
  if (begun_ && interval_s > 0.0 && interval_s <= kMaxGapS) {
    const hal::Vector3 mean =
        turn_rad(geometry::product(now, geometry::conjugate(last_))) * (1.0 / interval_s);
    rad_per_s_ = rad_per_s_ + (mean - rad_per_s_) * -std::expm1(-interval_s / kLagS);
  } else {
    rad_per_s_ = {};
  }
  begun_ = true;
  last_ = now;
  last_ns_ = time_ns;
  return rad_per_s_;
}

}  // namespace hapticd::server
