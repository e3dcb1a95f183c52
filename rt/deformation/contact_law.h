#pragma once

namespace hapticd::rt {

/// What a contact law makes of a normal force.
struct LawEstimate {
  double displacement_mm = 0.0;
  double mm_per_n = 0.0;  ///< ∂x/∂f at this tick: what a newton of noise becomes
};

}  // namespace hapticd::rt
