#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

#include "rt/deformation/creep_law.h"

namespace hapticd::identification {

/// The force with which a creep law answers to a given displacement: its inverse, sample by sample. With Ψ
/// undone, the present force is what of e the past does not account for, divided by how much of a newton
/// counts in the step it comes. (All zeros of the lags are negative, so the inverse is as stable as the law.)
///
/// Never negative; rises with the displacement; no displacement, or one that is not a number, has no
/// effective force. Beyond the last knot Ψ is a straight line and its inverse exact, within the knots it is
/// right to a 10⁻¹⁴ of max_force_n, in bounded time.
class CreepForce {
 public:
  explicit CreepForce(const rt::CreepParameters& parameters) noexcept
      : parameters_(parameters), law_(parameters, 1000.0) {
    double sum = 0.0;
    for (const double w : parameters.weight) sum += w;
    for (double& w : parameters_.weight) w /= sum;
  }

  /// `step_s`: since the sample before; one that is not a positive number counts as none.
  double update(double displacement_mm, double step_s) noexcept {
    const double elapsed_s = step_s > 0.0 ? step_s : 0.0;
    double now = parameters_.weight[0];
    double past_n = 0.0;
    std::array<double, rt::CreepParameters::kLags> decay{};
    for (std::size_t i = 0; i < decay.size(); ++i) {
      decay[i] = std::exp(-elapsed_s / parameters_.time_s[i]);
      now += parameters_.weight[i + 1] * (1.0 - decay[i]);
      past_n += parameters_.weight[i + 1] * decay[i] * lagged_n_[i];
    }
    const double force_n = std::max(0.0, (effective_force_n(displacement_mm) - past_n) / std::max(1e-6, now));
    for (std::size_t i = 0; i < decay.size(); ++i)
      lagged_n_[i] = force_n + (lagged_n_[i] - force_n) * decay[i];
    return force_n;
  }

  /// Ψ⁻¹: the force once the object has settled.
  double effective_force_n(double displacement_mm) const noexcept {
    if (!(displacement_mm > 0.0)) return 0.0;
    const rt::LawEstimate last = law_.curve(parameters_.max_force_n);
    if (displacement_mm >= last.displacement_mm) {
      return parameters_.max_force_n +
             (std::min(displacement_mm, kFarthestMm) - last.displacement_mm) / last.mm_per_n;
    }
    double low = 0.0;
    double high = parameters_.max_force_n;
    for (int i = 0; i < 48; ++i) {
      const double middle = 0.5 * (low + high);
      (law_.curve(middle).displacement_mm < displacement_mm ? low : high) = middle;
    }
    return 0.5 * (low + high);
  }

 private:
  static constexpr double kFarthestMm = 1e4;  // finite for an infinite displacement

  rt::CreepParameters parameters_;
  rt::CreepLaw law_;
  std::array<double, rt::CreepParameters::kLags> lagged_n_{};
};

}  // namespace hapticd::identification
