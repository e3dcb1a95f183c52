#pragma once

#include <optional>
#include <vector>

#include "hal/error.h"
#include "hal/samples.h"
#include "rt/inclusion/inclusion_parameters.h"
#include "server/identification/estimate/inclusion/inclusion_press.h"

namespace hapticd::identification {

/// A number and its standard error.
struct Estimated {
  double value = 0.0;
  double standard_error = 0.0;
};

/// One sample as the fit has it, along the normal.
struct InclusionFitPoint {
  double displacement_mm = 0.0;
  double measured_n = 0.0;
  double model_n = 0.0;
};

/// What an inclusion adds to an object, and where it is.
struct InclusionFit {
  rt::InclusionParameters inclusion;           ///< as the tip's own coordinates have it, for rendering
  hal::Vector3 place_mm;                       ///< of its centre in the body
  Estimated place_x_mm, place_y_mm, depth_mm;  ///< of its centre; depth below the nearest surface
  Estimated added_at_5mm_n;                    ///< H_t at 5 mm: known better than its K and m apart
  double own_at_5mm_n = 0.0;                   ///< of the object itself
  Estimated stiffness_n_per_mm_m, damping_n_s_per_mm_m1, exponent, attenuation, approach;
  double residual = 0.0;  ///< rms of what is left over, over the rms of what the inclusion adds
  /// Ratio of what is left over to what is left by the object's own response alone: near 1 if nothing is to
  /// be seen of an inclusion.
  double left_over_share = 0.0;
  bool at_bound = false;  ///< place or depth went as far as they may: the data do not show them
  double max_displacement_mm = 0.0;
  double max_speed_mm_per_s = 0.0;
  double max_force_n = 0.0;
  bool converged = false;
  std::vector<InclusionFitPoint> points;  ///< at most 200, of the presses with the inclusion
};

/// Fits an inclusion straight below the presses (5.3): the response of the object without it is fitted to
/// `without` and subtracted from the forces of `with`, and H_t is fitted to what is left. Place: the mean
/// surface point of `with`, and `depth_mm` below it, as known beforehand. `own`: the law of the object
/// without it, in the place of `without`.
hal::Result<InclusionFit> fit_inclusion_response(const std::vector<Press>& without,
                                                 const std::vector<Press>& with, double depth_mm,
                                                 const std::optional<rt::HuntCrossleyParameters>& own = {});

/// Fits presses all over the object: place, response and attenuation together with the object's own response,
/// by least squares. `without`: presses on the same object without an inclusion; if empty, those of `with`
/// that are far from the inclusion replace them, or the object's own law, if that is known. The surface is a
/// sphere through the surface points. If they are close to it, displacements count from it: over an inclusion
/// the threshold is passed sooner, and rendering counts from where the object without it is met. On an object
/// of another shape each press counts from its own surface point. `tip_radius_mm`: of the ball that presses,
/// whose lowest point is the tip; 0 = a point. Its error is in that of the depth.
hal::Result<InclusionFit> fit_inclusion_scan(const std::vector<Press>& without,
                                             const std::vector<Press>& with,
                                             const std::optional<rt::HuntCrossleyParameters>& own = {},
                                             const Estimated& tip_radius_mm = {});

}  // namespace hapticd::identification
