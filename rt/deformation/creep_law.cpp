#include "rt/deformation/creep_law.h"

#include <algorithm>
#include <cmath>

namespace hapticd::rt {

CreepLaw::CreepLaw(const CreepParameters& parameters, double rate_hz) noexcept
    : max_force_n_(parameters.max_force_n), knot_mm_(parameters.displacement_mm) {
  double sum = 0.0;
  for (const double w : parameters.weight) sum += w;
  weight_[0] = parameters.weight[0] / sum;
  for (std::size_t i = 0; i < CreepParameters::kLags; ++i) {
    weight_[i + 1] = parameters.weight[i + 1] / sum;
    decay_[i] = Decay(parameters.time_s[i], rate_hz);
  }
  set_interval(1.0);
  for (std::size_t j = 0; j <= kLast; ++j) {
    const double share = static_cast<double>(j) / kLast;
    knot_n_[j] = max_force_n_ * share * share;
  }
  // Fritsch and Carlson with the weighted harmonic mean of the neighbouring secants: monotone, no overshoot.
  const auto width = [&](std::size_t j) { return knot_n_[j + 1] - knot_n_[j]; };
  const auto secant = [&](std::size_t j) { return (knot_mm_[j + 1] - knot_mm_[j]) / width(j); };
  slope_mm_per_n_[0] = secant(0);
  slope_mm_per_n_[kLast] = secant(kLast - 1);
  for (std::size_t j = 1; j < kLast; ++j) {
    const double left = secant(j - 1);
    const double right = secant(j);
    const double a = 2.0 * width(j) + width(j - 1);
    const double b = width(j) + 2.0 * width(j - 1);
    slope_mm_per_n_[j] = left * right > 0.0 ? (a + b) / (a / left + b / right) : 0.0;
  }
}

void CreepLaw::set_interval(double periods) noexcept {
  periods_ = periods;
  immediate_ = weight_[0];
  for (std::size_t i = 0; i < CreepParameters::kLags; ++i) {
    kept_[i] = decay_[i].over(periods);
    immediate_ += weight_[i + 1] * (1.0 - kept_[i]);
  }
}

LawEstimate CreepLaw::update(double normal_force_n, double periods) noexcept {
  if (periods != periods_) set_interval(periods);
  const double force_n = std::max(0.0, normal_force_n);
  double effective_n = weight_[0] * force_n;
  for (std::size_t i = 0; i < CreepParameters::kLags; ++i) {
    lagged_n_[i] = force_n + (lagged_n_[i] - force_n) * kept_[i];
    effective_n += weight_[i + 1] * lagged_n_[i];
  }
  LawEstimate estimate = curve(effective_n);
  estimate.mm_per_n *= immediate_;
  return estimate;
}

LawEstimate CreepLaw::curve(double effective_force_n) const noexcept {
  if (!(effective_force_n > 0.0)) return {0.0, slope_mm_per_n_[0]};
  if (effective_force_n >= max_force_n_) {
    return {knot_mm_[kLast] + slope_mm_per_n_[kLast] * (effective_force_n - max_force_n_),
            slope_mm_per_n_[kLast]};
  }
  // The knots lie on a parabola, so the interval is found without a search.
  const auto j =
      std::min(static_cast<std::size_t>(kLast * std::sqrt(effective_force_n / max_force_n_)), kLast - 1);
  const double h = knot_n_[j + 1] - knot_n_[j];
  const double t = (effective_force_n - knot_n_[j]) / h;
  const double rise = knot_mm_[j + 1] - knot_mm_[j];
  // Cubic Hermite in t, written as knot + t (…).
  const double d0 = slope_mm_per_n_[j] * h;
  const double d1 = slope_mm_per_n_[j + 1] * h;
  const double c2 = 3.0 * rise - 2.0 * d0 - d1;
  const double c3 = d0 + d1 - 2.0 * rise;
  return {knot_mm_[j] + t * (d0 + t * (c2 + t * c3)), (d0 + t * (2.0 * c2 + 3.0 * t * c3)) / h};
}

}  // namespace hapticd::rt
