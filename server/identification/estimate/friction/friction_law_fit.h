#pragma once

#include <vector>

#include "hal/error.h"
#include "rt/friction/friction_model.h"
#include "server/identification/estimate/friction/friction_rows.h"

namespace hapticd::identification {

/// What is to be found and what is reported already.
struct FrictionFitOptions {
  rt::FrictionLaw law = rt::FrictionLaw::kDahl;
  bool exponent = false;  ///< Dahl's exponent is to be found too; else it is 1
  /// No more than this. A sharp start with a long tail is what a position that misses the start of each turn
  /// makes of any friction, so above 1 only where the position is the tip's own.
  double max_exponent = 3.0;
  bool bias = false;    ///< the friction channel may have a constant offset
  bool viscous = true;  ///< false: no viscous part
  /// A viscous part within two standard errors of nothing is left out; its standard error stays. For strokes
  /// that no one planned, which hardly distinguish it from the level.
  bool doubt_viscous = false;
  /// Slower than this the position does not show whether the tip moves: held by its own dry friction a device
  /// does not see the tip bend what it is on. Such rows are left out.
  double min_speed_mm_per_s = 0.0;
  /// A turn taken faster bends the device: its encoders run ahead of the tip. Presliding is read below this.
  double presliding_mm_per_s = 1e9;
  /// Slower than this is no sliding.
  double sliding_mm_per_s = 0.0;
};

struct FrictionLawFit {
  rt::FrictionParameters parameters;
  double bias_n = 0.0;
  /// One sigma, robust against errors that last as long as a passage: each passage counts as one observation
  /// of how wrong the law is (cluster-robust, Liang and Zeger 1986). Infinite where undetermined.
  rt::FrictionParameters error;
  double bias_error_n = 0.0;
  double residual = 0.0;               ///< rms left over rms of the friction, the offset subtracted
  double relative_error = 0.0;         ///< mean |left| over mean |friction|
  bool divided = false;                ///< sliding and presliding were distinguished; false: fitted together
  bool viscous_is_identified = false;  ///< speed varied enough, independently of the force
  int passages = 0;
  double rows = 0.0;  ///< instants used
};

/// Coulomb-viscous (4.11) or Dahl (4.12)-(4.15), scaled by the load. Where strokes slid farther than 3 mm,
/// divide and conquer (D§4.4.1): level and viscosity by linear least squares on sliding (way > 3 mm), robust
/// against what sticks out of it (Tukey's biweight), presliding by a search over what the first 0.5 mm after
/// a turn shows. There a finer search starts that takes in all that is no sliding, and the exponent where it
/// is free: the slope at the very start alone leaves the knee where it may. Shorter strokes never reach pure
/// sliding: all is fitted together. Fails where nothing slid or turned, and where friction goes along with
/// the motion (a reversed sign).
hal::Result<FrictionLawFit> fit_friction_law(const std::vector<FrictionRow>& rows,
                                             const FrictionFitOptions& options);

/// Friction a law gives at each row, the bias included; starts where a row says what is known. A solid tip's
/// parameters with Maxwell-slip elements are that law's.
std::vector<double> predicted_friction_n(const std::vector<FrictionRow>& rows,
                                         const rt::FrictionParameters& parameters, rt::FrictionLaw law,
                                         double bias_n);

}  // namespace hapticd::identification
