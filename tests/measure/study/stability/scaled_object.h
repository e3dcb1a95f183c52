#pragma once

#include <string>

#include "hal/sim/object/object_model.h"
#include "rt/model/models.h"

namespace hapticd::study {

/// How the viscosity of an object's surface is taken to grow with its stiffness: b ~ k^0.6. The presets that
/// have a source go from 4e-4 N·s/mm at 0.38 N/mm (sponge) over 2e-3 at 2.26 (eraser) to 1e-2 at 50 (wood):
/// exponents of 0.9 and 0.5, 0.66 from end to end.
inline constexpr double kViscosityExponent = 0.6;

/// The named preset, made as stiff as asked (secant at 4 N): the same force at a displacement smaller by the
/// factor s of the stiffnesses, F(x) = F₀(s x), relaxation times as they are, viscosity s^0.6-fold. Neither
/// mass (objects have none) nor friction changes. It is flat and even: a ball is not pressed in by its
/// radius. Throws std::invalid_argument for an unknown preset.
sim::ObjectModel scaled_object(const std::string& preset, double stiffness_n_per_mm);

/// Model that was identified of the preset, scaled: displacements of its creep law s-fold smaller. Only that
/// law is kept.
rt::ObjectModel scaled_model(const rt::ObjectModel& identified, const std::string& preset,
                             double stiffness_n_per_mm);

}  // namespace hapticd::study
