#pragma once

#include "rt/deformation/contact_law.h"

namespace hapticd::rt {

/// Displacement from two sources that fail at opposite ends. The path of the tip along the normal is exact
/// from the contact instant and drifts as soon as the tip slides, by the error of the direction; a contact
/// law does not drift, but is noisy at small force ((4.23): k~x/(m f) newtons per newton) and always wrong by
/// a few per cent. Both variances are known at each tick, so a scalar Kalman filter weighs them:
///
///   x⁻ = x - Δp·u,        P⁻ = P + θ² ℓ |Δp_t|
///   x  = x⁻ + g (x_law - x⁻),  g = P⁻/(P⁻ + R),  R = (∂x/∂f σ_f)² + (τ/T)(ε x + x_0)²
///
/// θ is the error of the direction, which stays much the same over a path ℓ; ε the law's own error, which
/// stays the same for a time τ and so counts as one reading in τ/T. g is in (0, 1): the estimate is always
/// between the two.
///
/// P is good for weighing, not for telling: a law is off by the same in a whole contact, and no number of
/// readings averages that out. So its share w in the estimate is followed, and deviation_mm() is
///
///   w = (1 - g) w + g,  V = (1 - g)² (V + θ² ℓ |Δp_t|) + g² (∂x/∂f σ_f)²,  σ² = V + (w (b ε x_max + x_b))²
///
/// x_max is the deepest so far: what a law makes of a release is off by what it made of the press. b and x_b
/// were chosen on the separable family of simulated objects and hold on the general one (`hapticd_study
/// uncertainty`).
class FusedDisplacement {
 public:
  /// `law_error`: ε; `force_noise_n`: σ_f.
  FusedDisplacement(double law_error, double force_noise_n, double rate_hz) noexcept;

  /// Begins with the tip at this depth, known within `deviation_mm`. A contact whose beginning was not seen
  /// has no path that could be trusted to better than `min_deviation_mm` later on: there the estimate goes on
  /// following the law.
  void begin(double displacement_mm, double deviation_mm, double min_deviation_mm = 0.0) noexcept;
  /// Advances by `path_mm`: -Δp·u, into the object; `slide_mm`: |Δp_t|; `periods` of the loop since the last.
  void update(double path_mm, double slide_mm, const LawEstimate& law, double periods = 1.0) noexcept;

  double displacement_mm() const noexcept { return displacement_mm_; }
  /// Standard deviation of displacement_mm().
  double deviation_mm() const noexcept;

 private:
  static constexpr double kDirectionErrorRad = 0.08;  // θ: 4.6°, some 8 % of a friction of 0.6
  static constexpr double kDirectionPathMm = 5.0;     // ℓ
  static constexpr double kLawErrorTimeS = 0.05;      // τ
  static constexpr double kLawOffsetMm = 0.05;        // x_0
  static constexpr double kBiasShare = 0.65;        // b: ε is an rms over a whole palpation, its worst included
  static constexpr double kBiasMm = 0.03;           // x_b
  static constexpr double kMinPeriods = 0.05;         // a reading that comes almost at once hardly counts

  double law_error_;
  double law_error_ticks_;
  double force_variance_n2_;
  double displacement_mm_ = 0.0;
  double variance_mm2_ = 0.0;
  double min_variance_mm2_ = 0.0;
  double law_share_ = 0.0;         ///< w
  double own_variance_mm2_ = 0.0;  ///< V: of the path and of the force's noise
  double deepest_mm_ = 0.0;        ///< x_max
};

}  // namespace hapticd::rt
