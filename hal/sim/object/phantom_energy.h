#pragma once

#include "hal/sim/object/reduced_function.h"

namespace hapticd::sim {

/// Energy of the tissue alone, N·mm, for the shear modulus of EcoFlex 00-30 with 50 % thinner.
const ReducedFunction& tissue_energy() noexcept;

/// What a stiff sphere adds and how it moves, for a depth of its centre of 19 … 31 mm.
struct InclusionFunctions {
  ReducedFunction energy;
  ReducedFunction along;   ///< movement out of the body, mm
  ReducedFunction across;  ///< movement away from the tip's side, mm over the angle in rad
};
InclusionFunctions inclusion_functions(double depth_mm) noexcept;

}  // namespace hapticd::sim
