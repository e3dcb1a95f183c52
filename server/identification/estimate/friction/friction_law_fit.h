#pragma once

#include <vector>

#include "hal/error.h"
#include "rt/friction/friction_model.h"
#include "server/identification/estimate/friction/friction_rows.h"

namespace hapticd::identification {

/// Options: what is to be found and what is known already.
struct FrictionFitOptions {
  rt::FrictionLaw law = rt::FrictionLaw::kDahl;
  bool exponent = false;  ///< Dahl's exponent is to be found too; else it is 1
  /// Maximum exponent. A position that misses the start of each turn makes any friction look like a sharp
  /// start with a long tail, so above 1 only if the position is the tip's own.
  double max_exponent = 3.0;
  bool bias = false;    ///< the friction channel may have a constant offset
  bool viscous = true;  ///< false: no viscous part
  /// True: a viscous part within two standard errors of zero is left out; its standard error stays. For
  /// strokes that were not planned, which hardly distinguish it from the level.
  bool doubt_viscous = false;
  /// Speed below which the position does not show whether the tip moves: held by its own dry friction a
  /// device does not see the tip bend what it is on. Such rows are left out.
  double min_speed_mm_per_s = 0.0;
  /// Speed below which presliding is read: a turn taken faster bends the device, and its encoders run ahead
  /// of the tip.
  double presliding_mm_per_s = 1e9;
  /// Speed below which the tip does not slide.
  double sliding_mm_per_s = 0.0;
};

struct FrictionLawFit {
  rt::FrictionParameters parameters;
  double bias_n = 0.0;
  /// Standard errors (one sigma), robust against errors that last as long as a passage: each passage counts
  /// as one observation of how wrong the law is (cluster-robust, Liang and Zeger 1986). Infinite if
  /// undetermined.
  rt::FrictionParameters error;
  double bias_error_n = 0.0;
  double residual = 0.0;               ///< rms left over rms of the friction, the offset subtracted
  double relative_error = 0.0;         ///< mean |left| over mean |friction|
  bool divided = false;                ///< sliding and presliding were distinguished; false: fitted together
  bool viscous_is_identified = false;  ///< speed varied enough, independently of the force
  int passages = 0;
  double rows = 0.0;  ///< instants used
};

/// Fits Coulomb-viscous (4.11) or Dahl (4.12)-(4.15) friction, scaled by the load. If strokes slid farther
/// than 3 mm, divide and conquer (D§4.4.1): level and viscosity by linear least squares on sliding (way > 3
/// mm), robust against outliers (Tukey's biweight), presliding by a search over what the first 0.5 mm after a
/// turn shows. From there a finer search takes in all that is not sliding, and the exponent if it is free:
/// the slope at the very start alone does not fix where the curve bends. Shorter strokes never reach pure
/// sliding: all is fitted together. Fails if nothing slid or turned, and if friction goes along with the
/// motion (a reversed sign).
hal::Result<FrictionLawFit> fit_friction_law(const std::vector<FrictionRow>& rows,
                                             const FrictionFitOptions& options);

/// Friction that a law gives at each row, the bias included; starts where a row says what is known. A solid
/// tip's parameters with Maxwell-slip elements are that law's.
std::vector<double> predicted_friction_n(const std::vector<FrictionRow>& rows,
                                         const rt::FrictionParameters& parameters, rt::FrictionLaw law,
                                         double bias_n);

}  // namespace hapticd::identification
