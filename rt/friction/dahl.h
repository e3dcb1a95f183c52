#pragma once

#include <cmath>
#include <limits>

#include "rt/signal/vector.h"

namespace hapticd::rt {

/// What is left of the way to full friction after sliding on by `path_mm`: u⁺/u, where u = 1 - s z falls from
/// 2 (full friction the other way) to 0 by du/dl = -u^i / δ, (4.12) with its exponent i (D writes α):
///   u⁺ = u exp(-l/δ) for i = 1,   u⁺ = (u^(1-i) - (1-i) l/δ)^(1/(1-i)) otherwise.
/// For i < 1 full friction is reached after the finite way δ u^(1-i) / (1-i); i = 0 is straight up to there.
/// 0 ≤ i ≤ 3; continuous at i = 1. δ → 0 is Coulomb friction.
struct DahlDecay {
  double kept = 0.0;  ///< u⁺/u
  double log_kept = -std::numeric_limits<double>::infinity();
};
inline DahlDecay dahl_decay(double to_go, double path_mm, double presliding_mm, double exponent) noexcept {
  if (!(presliding_mm > 0.0)) return {};
  double log_kept = -path_mm / presliding_mm;
  if (exponent != 1.0) {
    if (!(to_go > 0.0)) return {};  // there already
    const double rest = 1.0 - exponent;
    const double spent = rest * (path_mm / presliding_mm) * std::pow(to_go, -rest);
    if (!(spent < 1.0)) return {};
    log_kept = std::log1p(-spent) / rest;
  }
  return {std::exp(log_kept), log_kept};
}
inline double dahl_decay_factor(double to_go, double path_mm, double presliding_mm,
                                double exponent) noexcept {
  return dahl_decay(to_go, path_mm, presliding_mm, exponent).kept;
}

/// Derivatives of a step's result, which follow from its dahl_decay(). With exponent i:
///   ∂u⁺/∂u = kept^i,   ∂(u⁺/u)/∂ln δ = (kept^i - kept)/(1 - i), which is kept ln(1/kept) for i = 1.
struct DahlSensitivity {
  double to_start = 0.0;       ///< of what is left of the way on what was
  double to_presliding = 0.0;  ///< of `kept` on the relative error of the presliding distance
};
inline DahlSensitivity dahl_sensitivity(const DahlDecay& decay, double exponent) noexcept {
  const auto [kept, log_kept] = decay;
  if (!(kept > 0.0)) return {};
  const double rest = 1.0 - exponent;
  const double to_start = rest == 0.0 ? kept : std::exp(exponent * log_kept);
  // expm1: continuous at i = 1.
  const double to_presliding =
      std::abs(rest) < 1e-9 ? -kept * log_kept : to_start * -std::expm1(rest * log_kept) / rest;
  return {to_start, to_presliding};
}

/// One step of Dahl's equation (4.12) in the state z = f/f_c: exact for motion in one direction,
///   z⁺ = s + (z - s) u⁺/u,  s = Δx/|Δx|;  with α = 1: z⁺ = s + (z - s) exp(-|Δx|/δ).
/// (4.14) counts the way since the last reset although it starts from the present friction; this counts the
/// step's own. As a convex combination it never leaves |z| ≤ 1, needs no reset at zero velocity, does not
/// move at Δx = 0 for however long, and is defined at zero load. A step that is not a number moves nothing.
inline double dahl_step(double z, double slide_mm, double presliding_mm, double exponent = 1.0) noexcept {
  if (!(std::abs(slide_mm) > 0.0)) return z;
  const double s = std::copysign(1.0, slide_mm);
  return s + (z - s) * dahl_decay_factor(1.0 - s * z, std::abs(slide_mm), presliding_mm, exponent);
}

/// Dahl's step in the tangent plane: z points along the sliding that built it up. With dz/dl = (s - z)
/// u^(i-1)/δ the share u = 1 - s·z follows the very equation of the scalar, and z - s shrinks with it.
inline hal::Vector3 dahl_step(const hal::Vector3& z, const hal::Vector3& slide_mm, double presliding_mm,
                              double exponent = 1.0) noexcept {
  const double path_mm = norm(slide_mm);
  if (!(path_mm > 1e-12)) return z;
  const hal::Vector3 s = slide_mm * (1.0 / path_mm);
  return s + (z - s) * dahl_decay_factor(1.0 - dot(s, z), path_mm, presliding_mm, exponent);
}

}  // namespace hapticd::rt
