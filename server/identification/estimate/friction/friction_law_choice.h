#pragma once

#include <cstdint>
#include <vector>

#include "server/identification/estimate/friction/friction_law_fit.h"
#include "server/identification/estimate/friction/friction_rows.h"
#include "server/identification/estimate/friction/maxwell_slip_fit.h"
#include "server/identification/estimate/held_out_error.h"

namespace hapticd::identification {

/// Form of law for a solid tip's friction, the simpler first.
enum class FrictionForm : std::uint8_t {
  kDahl,          ///< exponent 1 (D§4.4.1)
  kDahlExponent,  ///< the exponent found
  kMaxwellSlip,   ///< up to eight elements
};

/// Errors of laws of a solid tip's friction on passages that were held out of their fit.
struct FrictionLawChoice {
  HeldOutError dahl, dahl_exponent, maxwell_slip;

  /// Simplest form that no richer one beats by more than the richer one's standard error.
  FrictionForm form() const noexcept;
};

/// Options that apply to the Maxwell-slip law.
MaxwellSlipFitOptions maxwell_slip_options(const FrictionFitOptions& options) noexcept;

/// Judges each law on friction, the offset of the channel subtracted, over folds of whole strokes both ways:
/// what is left of a passage lasts as long as it does. `options.exponent` does not matter.
FrictionLawChoice choose_friction_law(const std::vector<FrictionRow>& rows, FrictionFitOptions options);

}  // namespace hapticd::identification
