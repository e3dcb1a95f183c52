#pragma once

#include <vector>

#include "hal/error.h"

namespace hapticd::identification {

/// A touched point of a profile.
struct ProfilePoint {
  double along_mm = 0.0;
  double height_mm = 0.0;
};

/// Value and slope of a profile with their standard errors (one sigma).
struct ProfileValue {
  double height_mm = 0.0;
  double slope = 0.0;  ///< dh/ds
  double height_error_mm = 0.0;
  double slope_error = 0.0;
};

/// Parabola through the points and, on what it leaves, a natural cubic smoothing spline (Reinsch 1967) that
/// minimises Σ (h_i - g(s_i))² + λ ∫ g''². Without the parabola a curved surface would be made straight at
/// its ends, where strokes turn. Restricted maximum likelihood finds the smoothing and the points' error from
/// the points themselves (Wahba 1985); the standard errors are those of the resulting posterior, with the
/// parabola's own added. Beyond the outermost points the parabola and the spline's slope go on.
class SurfaceSpline {
 public:
  static constexpr std::size_t kMaxPoints = 200;

  /// Points closer than 1e-3 mm along count as one. `min_error_mm`: least uncertainty of a point's height,
  /// e.g. the encoders' rounding. Fails with fewer than five places, more than kMaxPoints, or points that are
  /// not finite.
  static hal::Result<SurfaceSpline> fit(std::vector<ProfilePoint> points, double min_error_mm);

  ProfileValue at(double along_mm) const;
  /// Place along the profile that is nearest to a point, e.g. to a tip that has pressed it down.
  double nearest_along_mm(double along_mm, double height_mm) const;

  double from_mm() const { return along_mm_.front(); }
  double to_mm() const { return along_mm_.back(); }
  std::size_t points() const { return along_mm_.size(); }
  double point_error_mm() const { return point_error_mm_; }  ///< scatter of the points about the profile

 private:
  SurfaceSpline() = default;

  double parabola(double along_mm, double& slope) const;

  double centre_mm_ = 0.0;
  double curvature_per_mm_ = 0.0;        ///< of the parabola; its slope at the centre is part of the spline
  double curvature_error_per_mm_ = 0.0;  ///< one sigma
  double spread_mm2_ = 0.0;              ///< mean square distance of the points from the centre
  std::vector<double> along_mm_;
  std::vector<double> height_mm_;       ///< of the spline at the knots
  std::vector<double> bend_per_mm_;     ///< its second derivative there; 0 at the ends
  std::vector<double> covariance_mm2_;  ///< of the knots' heights, row by row
  std::vector<double> bend_of_height_;  ///< bend = this matrix · heights, row by row
  double point_error_mm_ = 0.0;
};

}  // namespace hapticd::identification
