#pragma once

#include <vector>

#include "rt/identify/friction_law_fit.h"
#include "rt/identify/friction_rows.h"
#include "rt/identify/held_out_error.h"

namespace hapticd::rt {

/// How well laws of a solid tip's friction predict passages that were held out of their fit, the simpler
/// first: Dahl's with exponent 1 (D§4.4.1), with its exponent found, and Maxwell-slip.
struct FrictionLawChoice {
  HeldOutError dahl, dahl_exponent, maxwell_slip;

  /// The data ask for another exponent than 1.
  bool exponent() const noexcept { return pays(dahl_exponent, dahl); }
};

/// Judges each law on friction, the offset of the channel taken off, over folds of whole strokes both ways:
/// what is left of a passage lasts as long as it does. `options.exponent` does not matter.
FrictionLawChoice choose_friction_law(const std::vector<FrictionRow>& rows, FrictionFitOptions options);

}  // namespace hapticd::rt
