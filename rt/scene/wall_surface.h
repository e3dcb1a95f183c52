#pragma once

#include <cmath>
#include <optional>

#include "hal/samples.h"

namespace hapticd::rt {

/// A ball as virtual object (D§4.7.1).
struct BallParameters {
  hal::Vector3 centre_mm{0.0, 0.0, -25.0};  ///< rig frame
  double radius_mm = 25.0;

  bool operator==(const BallParameters& other) const {
    return centre_mm.x == other.centre_mm.x && centre_mm.y == other.centre_mm.y &&
           centre_mm.z == other.centre_mm.z && radius_mm == other.radius_mm;
  }
};

/// Where a virtual object begins: a plane across the press axis, or a ball. Without friction.
class WallSurface {
 public:
  struct Place {
    double depth_mm = 0.0;  ///< below the surface; negative: outside
    hal::Vector3 inward;    ///< unit vector, from the nearest point of the surface on
  };

  /// `press_axis`: unit vector into the plane, whose coordinate along it is `position_mm`.
  WallSurface(const hal::Vector3& press_axis, double position_mm,
              const std::optional<BallParameters>& ball) noexcept
      : axis_(press_axis), position_mm_(position_mm), ball_(ball) {}

  /// In the middle of a ball, where no side is nearest, it is as if pressed along the press axis.
  Place at(const hal::Vector3& tip_mm) const noexcept {
    if (!ball_) return {dot(tip_mm, axis_) - position_mm_, axis_};
    const hal::Vector3 to_centre_mm = ball_->centre_mm - tip_mm;
    const double distance_mm = std::sqrt(dot(to_centre_mm, to_centre_mm));
    constexpr double kMiddleMm = 1e-6;
    return {ball_->radius_mm - distance_mm,
            distance_mm > kMiddleMm ? to_centre_mm * (1.0 / distance_mm) : axis_};
  }
  bool is_curved() const noexcept { return ball_.has_value(); }

 private:
  hal::Vector3 axis_;
  double position_mm_;
  std::optional<BallParameters> ball_;
};

}  // namespace hapticd::rt
