#pragma once

#include "hal/samples.h"
#include "rt/inclusion/inclusion_parameters.h"

namespace hapticd::rt {

/// How the tip presses, as the pipeline estimates it. Rig frame.
struct Indentation {
  hal::Vector3 tip_mm;
  hal::Vector3 normal{0.0, 0.0, 1.0};  ///< out of the object, length 1
  double displacement_mm = 0.0;        ///< ≥ 0, along the normal
  double rate_mm_per_s = 0.0;          ///< of it
};

/// Force of the response along l_0 at a displacement, and its integral. Beyond the displacement that it was
/// identified to its slope fades; past the sphere, beyond l_0, the force fades, too: both are bounded.
struct InclusionResponse {
  double elastic_n = 0.0;
  double energy_n_mm = 0.0;
  double damping_n_s_per_mm = 0.0;
};
InclusionResponse response_at(const InclusionParameters& inclusion, double displacement_mm) noexcept;

/// The share A of the response that is left off l_0, and its slopes. The strain of a load on an
/// incompressible half-space falls as cos θ / r²; a small stiff sphere takes in energy as its square,
///   A = (a_0 / a)^(n-2) (a² / (a² + s²))^(n/2),  n = 6,  a = l - β x,  a_0 = l_0 - β x,
/// l and s being the depth of the sphere below the surface point and its distance from the normal there, and
/// β x how far the tip has come nearer to the sphere: half the displacement by (6.2). A = 1 on l_0, and
/// nowhere more: l counts as l_0 at least. It fades from 60° to 90° between normal and l_0.
struct InclusionShare {
  double value = 0.0;
  double by_displacement = 0.0;  ///< 1/mm
  hal::Vector3 by_place;         ///< across the normal, 1/mm
};
InclusionShare share_at(const InclusionParameters& inclusion, const Indentation& at) noexcept;

/// Force on the tip, the gradient of U = E(x) A(x, s): along the normal E' A + E ∂A/∂x, damped as the
/// response is; across it -E ∂A/∂s, away from the sphere. Never pulls along the normal.
hal::Vector3 energy_force_n(const InclusionParameters& inclusion, const Indentation& at) noexcept;

/// Force on the tip by (5.4) to (5.7). Nothing if the tip is at the sphere's centre.
hal::Vector3 published_force_n(const InclusionParameters& inclusion, const Indentation& at) noexcept;

/// d_t (6.1): where the sphere has moved. (6.2) is solved exactly by d_t = d/2, once what is left of its
/// transient, exp(-Kt/B), is over: it begins at zero with each contact. (6.3) diverges.
hal::Vector3 movement_mm(const InclusionParameters& inclusion, const Indentation& at) noexcept;

}  // namespace hapticd::rt
