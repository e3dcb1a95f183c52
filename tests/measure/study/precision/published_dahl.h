#pragma once

#include <cmath>

namespace hapticd::study {

/// Dahl's friction as published and as a first attempt would step it; candidates that hapticd does not ship
/// (rt/friction/dahl.h is the exact step). Both keep the force itself as their state, N, and take the
/// stiffness σ in N/mm as given whatever the load; `coulomb_n` is f_c = μ_k f_n (4.13).

/// (4.14): F⁺ = f_c s + (F - f_c s) exp(-σ |x_i - x| / f_c), x_i the place where the velocity was last zero.
/// The way since then counts again in each step although F has grown along it already.
class PublishedDahl {
 public:
  explicit PublishedDahl(double stiffness_n_per_mm) noexcept : stiffness_n_per_mm_(stiffness_n_per_mm) {}

  double step(double slide_mm, double velocity_mm_per_s, double coulomb_n) noexcept {
    path_mm_ = velocity_mm_per_s == 0.0 ? 0.0 : path_mm_ + slide_mm;
    if (slide_mm == 0.0 || !(coulomb_n > 0.0)) return force_n_;
    const double full_n = std::copysign(coulomb_n, slide_mm);
    force_n_ = full_n + (force_n_ - full_n) * std::exp(-stiffness_n_per_mm_ * std::abs(path_mm_) / coulomb_n);
    return force_n_;
  }

 private:
  double stiffness_n_per_mm_;
  double path_mm_ = 0.0;
  double force_n_ = 0.0;
};

/// (4.12) with α = 1 by explicit Euler: F⁺ = F + σ Δx (1 - F s / f_c). Stable for σ |Δx| / f_c < 2 only,
/// without ringing below 1.
class EulerDahl {
 public:
  explicit EulerDahl(double stiffness_n_per_mm) noexcept : stiffness_n_per_mm_(stiffness_n_per_mm) {}

  double step(double slide_mm, double coulomb_n) noexcept {
    if (slide_mm == 0.0 || !(coulomb_n > 0.0)) return force_n_;
    const double s = std::copysign(1.0, slide_mm);
    force_n_ += stiffness_n_per_mm_ * slide_mm * (1.0 - s * force_n_ / coulomb_n);
    return force_n_;
  }

 private:
  double stiffness_n_per_mm_;
  double force_n_ = 0.0;
};

}  // namespace hapticd::study
