#pragma once

#include <cstddef>
#include <limits>
#include <span>

#include "rt/deformation/hunt_crossley.h"
#include "server/identification/gate/palpation_sample.h"

namespace hapticd::identification {

/// Hunt-Crossley law (4.22) that was found by one of the methods.
struct HuntCrossleyEstimate {
  rt::HuntCrossleyParameters parameters;
  double contact_offset_mm = 0.0;  ///< the surface lies so far before the samples' zero
  std::size_t samples = 0;         ///< the estimate rests on
};

/// Error bounds of a Hunt-Crossley law found by any method, from what it leaves of the force. Infinite if the
/// data do not show a parameter.
///
/// Uncertainty of a law. Residuals of a palpation are not independent errors: most of each is what the law
/// cannot represent, and that lasts as long as a press. So the covariance is J⁺ S J⁺ᵀ with S the long-run
/// covariance of the scores, summed over blocks of time and weighted over neighbouring blocks (Newey and West
/// 1987): what counts is how many times a press was tried, not how many samples were taken meanwhile.
struct HuntCrossleyUncertainty {
  double stiffness_n_per_mm_m = std::numeric_limits<double>::infinity();  ///< standard errors
  double damping_n_s_per_mm_m1 = std::numeric_limits<double>::infinity();
  double exponent = std::numeric_limits<double>::infinity();
  double contact_offset_mm = std::numeric_limits<double>::infinity();  ///< if it was estimated, too
  double relative_force = std::numeric_limits<double>::infinity();  ///< of the force at the deepest, slowly
  double relative_force_half = std::numeric_limits<double>::infinity();  ///< and at half of it
  double residual = std::numeric_limits<double>::quiet_NaN();            ///< rms left over rms force
};

/// `with_offset`: the contact offset is one of the estimated parameters.
HuntCrossleyUncertainty hunt_crossley_uncertainty(const HuntCrossleyEstimate& estimate,
                                                  std::span<const PalpationSample> palpation,
                                                  bool with_offset);

/// Whether a sample says anything about a contact law.
constexpr bool identifies_contact(const PalpationSample& s, double contact_offset_mm = 0.0) noexcept {
  return s.in_contact && s.displacement_mm + contact_offset_mm > 0.0 && s.normal_force_n > 0.0;
}

}  // namespace hapticd::identification
