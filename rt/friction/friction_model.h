#pragma once

#include <cstdint>
#include <optional>

#include "rt/friction/maxwell_slip.h"

namespace hapticd::rt {

enum class FrictionLaw : std::uint8_t {
  kDahl,            ///< (4.12)-(4.15), exact and scaled by the load: a solid tip
  kCoulombViscous,  ///< (4.11): a rolling tip without presliding
};

/// Friction of a tip on a surface: f_t = μ_k f_n z + μ_b v with z, |z| ≤ 1, the share of sliding friction
/// that has built up: by Dahl's law, or by that of Maxwell-slip elements if there are any.
struct FrictionParameters {
  double kinetic = 0.0;             ///< μ_k
  double presliding_mm = 0.0;       ///< δ = f_c / σ: way over which z builds up; unused by Coulomb-viscous
  double viscous_n_s_per_mm = 0.0;  ///< μ_b
  double exponent = 1.0;  ///< of Dahl's equation (4.12), 0 … 3: 1 approaches f_c for ever, less gets there
  /// Law in place of Dahl's, for a solid tip; `kinetic` and `presliding_mm` are then theirs together.
  std::optional<MaxwellSlipParameters> maxwell_slip{};
  double presliding_relative_error = 0.0;  ///< standard deviation over δ, as identified; 0 = not known
};

/// What the dissertation identified for a ball-bearing tip, the mean over five soft objects (D§4.4.1). A
/// rolling tip too gives way a little before it rolls: 0.05 mm, assumed.
inline constexpr FrictionParameters kBallBearingFriction{0.0643, 0.05, 0.000244};

}  // namespace hapticd::rt
