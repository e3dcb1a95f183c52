#pragma once

#include <cmath>
#include <optional>
#include <utility>

#include "hal/samples.h"
#include "rt/scene/surface_map.h"

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

/// Surface at which a virtual object begins: a plane across the press axis, a ball, or a scanned surface.
/// Without friction.
class WallSurface {
 public:
  struct Place {
    double depth_mm = 0.0;  ///< below the surface; negative: outside
    hal::Vector3 inward;    ///< unit vector, from the nearest point of the surface on
  };

  /// `press_axis`: unit vector into the plane, whose coordinate along it is `position_mm`.
  WallSurface(const hal::Vector3& press_axis, double position_mm, const std::optional<BallParameters>& ball,
              const std::optional<SurfaceMapParameters>& map)
      : axis_(press_axis), position_mm_(position_mm), ball_(ball) {
    if (map) map_.emplace(*map);
  }

  /// Place of the tip to the surface. In the middle of a ball, which has no nearest side, it is as if pressed
  /// along the press axis. For a scanned surface depth and normal are those of the tangent plane above or
  /// below the tip: exact on planes, off by half the curvature times the square of depth and slope elsewhere.
  Place at(const hal::Vector3& tip_mm) const noexcept {
    if (map_) return over_map(tip_mm);
    if (!ball_) return {dot(tip_mm, axis_) - position_mm_, axis_};
    const hal::Vector3 to_centre_mm = ball_->centre_mm - tip_mm;
    const double distance_mm = std::sqrt(dot(to_centre_mm, to_centre_mm));
    constexpr double kMiddleMm = 1e-6;
    return {ball_->radius_mm - distance_mm,
            distance_mm > kMiddleMm ? to_centre_mm * (1.0 / distance_mm) : axis_};
  }
  bool is_curved() const noexcept { return ball_ || map_; }

 private:
  Place over_map(const hal::Vector3& tip_mm) const noexcept {
    const SurfaceMap::Point point = map_->at(tip_mm.x, tip_mm.y);
    const double cosine =
        1.0 / std::sqrt(1.0 + point.slope_x * point.slope_x + point.slope_y * point.slope_y);
    return {(point.height_mm - tip_mm.z) * cosine,
            hal::Vector3{point.slope_x * cosine, point.slope_y * cosine, -cosine}};
  }

  hal::Vector3 axis_;
  double position_mm_;
  std::optional<BallParameters> ball_;
  std::optional<SurfaceMap> map_;
};

}  // namespace hapticd::rt
