#pragma once

#include <vector>

#include "hal/error.h"
#include "rt/model/models.h"
#include "server/identification/gate/palpation_sample.h"

namespace hapticd::identification {

/// Single-stage log-linear fit of (4.22) (D§4.5.1, Haddadi and Hashtrudi-Zaad): ln f = ln K + m ln x +
/// (B/K) ẋ by least squares, weighted by f², over samples in contact with f > 0.1 N and x > a tenth of the
/// deepest. The linearisation wants |B/K·ẋ| < 0.1: samples beyond are left out in a second pass. Fails if
/// fewer than 100 samples remain or they do not determine the parameters apart.
hal::Result<rt::IdentifiedLaw<rt::HuntCrossleyParameters>> fit_hunt_crossley(
    const std::vector<PalpationSample>& palpation);

/// Fit of the creep law to a whole palpation, pauses out of contact included, one sample a tick from a
/// rested object. Ψ is found by non-negative least squares on its increments for given weights, the weights
/// by pattern search on the simplex (a separable problem); errors count relative to x + 5 % of the deepest.
/// Fails like fit_hunt_crossley().
hal::Result<rt::IdentifiedLaw<rt::CreepParameters>> fit_creep(const std::vector<PalpationSample>& palpation,
                                                              double rate_hz);

}  // namespace hapticd::identification
