#include "server/identification/estimate/contact/contact_estimate.h"

#include <algorithm>
#include <cmath>

#include "server/identification/estimate/contact/contact_sandwich.h"

namespace hapticd::identification {

HuntCrossleyUncertainty hunt_crossley_uncertainty(const HuntCrossleyEstimate& estimate,
                                                  std::span<const PalpationSample> palpation,
                                                  bool with_offset) {
  const rt::HuntCrossleyParameters& law = estimate.parameters;
  const double offset_mm = estimate.contact_offset_mm;
  const bool with_damping = law.damping_n_s_per_mm_m1 > 0.0;  // at its bound it is not a free parameter
  const auto reported = static_cast<std::size_t>(
      std::count_if(palpation.begin(), palpation.end(),
                    [&](const PalpationSample& s) { return identifies_contact(s, offset_mm); }));
  const Eigen::Index n = 2 + (with_damping ? 1 : 0) + (with_offset ? 1 : 0);
  const Eigen::Index damping_at = 2;
  const Eigen::Index offset_at = with_damping ? 3 : 2;

  SandwichCovariance<4> sandwich(n, reported);
  SandwichCovariance<4>::Vector jacobian(n);
  double left = 0.0, whole = 0.0, deepest_mm = 0.0;
  for (const PalpationSample& s : palpation) {
    if (!identifies_contact(s, offset_mm)) continue;
    const double x = s.displacement_mm + offset_mm;
    const double log_x = std::log(x);
    const double power = std::exp(law.exponent * log_x);
    const double force_n = (law.stiffness_n_per_mm_m + law.damping_n_s_per_mm_m1 * s.rate_mm_per_s) * power;
    const double error_n = s.normal_force_n - force_n;
    jacobian(0) = power;
    jacobian(1) = force_n * log_x;
    if (with_damping) jacobian(damping_at) = power * s.rate_mm_per_s;
    if (with_offset) jacobian(offset_at) = law.exponent * force_n / x;
    sandwich.add(jacobian, error_n);
    left += error_n * error_n;
    whole += s.normal_force_n * s.normal_force_n;
    deepest_mm = std::max(deepest_mm, x);
  }
  HuntCrossleyUncertainty result;
  if (!(whole > 0.0)) return result;
  result.residual = std::sqrt(left / whole);

  const auto covariance = sandwich.covariance();
  const auto error_of = [&](Eigen::Index i) { return std::sqrt(std::max(0.0, covariance(i, i))); };
  result.stiffness_n_per_mm_m = error_of(0);
  result.exponent = error_of(1);
  if (with_damping) result.damping_n_s_per_mm_m1 = error_of(damping_at);
  result.contact_offset_mm = with_offset ? error_of(offset_at) : 0.0;
  if (!std::isfinite(result.exponent)) return result;
  const auto relative_force = [&](double x) {
    SandwichCovariance<4>::Vector gradient = SandwichCovariance<4>::Vector::Zero(n);
    gradient(0) = 1.0 / law.stiffness_n_per_mm_m;
    gradient(1) = std::log(x);
    if (with_offset) gradient(offset_at) = law.exponent / x;
    return std::sqrt(std::max(0.0, gradient.dot(covariance * gradient)));
  };
  result.relative_force = relative_force(deepest_mm);
  result.relative_force_half = relative_force(0.5 * deepest_mm);
  return result;
}

}  // namespace hapticd::identification
