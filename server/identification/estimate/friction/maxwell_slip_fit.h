#pragma once

#include <vector>

#include "hal/error.h"
#include "rt/friction/friction_model.h"
#include "rt/friction/maxwell_slip.h"
#include "server/identification/estimate/friction/friction_rows.h"

namespace hapticd::identification {

struct MaxwellSlipFit {
  rt::MaxwellSlipParameters parameters;
  double viscous_n_s_per_mm = 0.0;
  double bias_n = 0.0;
  double residual = 0.0;  ///< rms left over rms of the friction

  /// Friction as models hold it: level and presliding are those of the elements together.
  rt::FrictionParameters friction() const noexcept {
    return {parameters.kinetic(), parameters.presliding_mm(), viscous_n_s_per_mm, 1.0, parameters};
  }
};

/// Options of FrictionFitOptions that this law has: an offset, a viscous part, what is too slow.
struct MaxwellSlipFitOptions {
  bool bias = false;
  bool viscous = false;
  double min_speed_mm_per_s = 0.0;
};

/// Fits a Maxwell-slip law: stiffnesses by non-negative least squares over a ladder of reaches up to the
/// longest way, then again over the few that mattered. Fails like fit_friction_law().
hal::Result<MaxwellSlipFit> fit_maxwell_slip(const std::vector<FrictionRow>& rows,
                                             const MaxwellSlipFitOptions& options);

/// Friction that the fit gives at each row, the bias included.
std::vector<double> predicted_friction_n(const std::vector<FrictionRow>& rows, const MaxwellSlipFit& fit);

}  // namespace hapticd::identification
