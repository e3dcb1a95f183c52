#pragma once

namespace hapticd::rt {

/// Displacement that a contact law gives for a normal force.
struct LawEstimate {
  double displacement_mm = 0.0;
  double mm_per_n = 0.0;  ///< ∂x/∂f at this tick: the error that a newton of noise causes
};

}  // namespace hapticd::rt
