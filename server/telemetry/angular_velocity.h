#pragma once

#include <cstdint>

#include "hal/samples.h"

namespace hapticd::server {

/// How fast a tool turns, from its orientations one after the other: the mean turn between two, smoothed by a
/// first-order lag of 20 ms, exact for any spacing. After a gap of more than 0.1 s, or if time runs
/// backwards, it begins with 0.
class AngularVelocity {
 public:
  static constexpr double kLagS = 0.020;
  static constexpr double kMaxGapS = 0.1;

  /// Angular velocity, rad/s, in the frame that the orientation turns into. The last value if the orientation
  /// is not a rotation.
  hal::Vector3 follow(const hal::Quaternion& orientation, std::int64_t time_ns) noexcept;

 private:
  hal::Quaternion last_;
  std::int64_t last_ns_ = 0;
  hal::Vector3 rad_per_s_;
  bool begun_ = false;
};

}  // namespace hapticd::server
