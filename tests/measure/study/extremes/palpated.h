#pragma once

#include <cstdint>
#include <vector>

#include "rt/deformation/hunt_crossley.h"
#include "server/identification/gate/palpation_sample.h"

namespace hapticd::study::extremes {

/// Presses back and forth on an object that is exactly this law, at 1 kHz: depths up to `deepest_mm`, rates
/// that change all the time, white noise of the force.
std::vector<identification::PalpationSample> palpated(const rt::HuntCrossleyParameters& law,
                                                      double deepest_mm, double seconds, double noise_n,
                                                      std::uint64_t seed);

}  // namespace hapticd::study::extremes
