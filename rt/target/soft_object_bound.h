#pragma once

#include <algorithm>

#include "rt/target/largest_target.h"

namespace hapticd::rt {

/// Bound of a target by what the object under the tip bears itself: a device that gives nearly all of what is
/// felt renders a virtual object that hangs on a thread. A hand with 4 N on an object of 0.05 N/mm (knocks,
/// encoders 2 ms late, modes of 60 … 220 Hz) became unstable from 14 times its stiffness on
/// (`hapticd_study stability`).
///
/// The object's stiffness is its secant f_r/x, behind a lag of kLagS and beyond kSurfaceMm only, so that the
/// bound moves more slowly than a hand and noise does not reach the target. It does not bind at the surface,
/// nor on objects on which it would be more than kMaxTargetNPerMm: a scene that asks for more knows why.
class SoftObjectBound {
 public:
  static constexpr double kMaxRatio = 12.0;
  static constexpr double kLagS = 0.2;
  static constexpr double kSurfaceMm = 1.0;

  /// A contact begins with this target.
  void begin(double target_n_per_mm) noexcept { most_n_per_mm_ = target_n_per_mm; }
  /// Takes what a tick read, N, mm, s; returns the target within the bound. Implicit: stable for any
  /// interval.
  double update(double target_n_per_mm, double reaction_n, double displacement_mm,
                double interval_s) noexcept {
    if (displacement_mm > kSurfaceMm) {
      double allowed_n_per_mm = kMaxRatio * std::max(0.0, reaction_n) / displacement_mm;
      if (allowed_n_per_mm >= kMaxTargetNPerMm)
        allowed_n_per_mm = std::max(allowed_n_per_mm, target_n_per_mm);
      most_n_per_mm_ += (allowed_n_per_mm - most_n_per_mm_) * interval_s / (kLagS + interval_s);
    } else {
      most_n_per_mm_ = std::max(most_n_per_mm_, target_n_per_mm);
    }
    return std::min(target_n_per_mm, most_n_per_mm_);
  }

 private:
  double most_n_per_mm_ = 0.0;
};

}  // namespace hapticd::rt
