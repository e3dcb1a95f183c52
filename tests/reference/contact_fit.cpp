#include "tests/reference/contact_fit.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

#include "server/identification/estimate/contact/contact_creep_fit.h"

namespace hapticd::identification {

namespace {

constexpr std::size_t kMinSamples = 100;

double deepest_mm(const std::vector<PalpationSample>& palpation) {
  double deepest = 0.0;
  for (const PalpationSample& s : palpation) {
    if (s.in_contact) deepest = std::max(deepest, s.displacement_mm);
  }
  return deepest;
}

hal::Error too_little(std::size_t samples) {
  return {"the palpation does not determine the model's parameters", "identification of the contact law",
          std::to_string(samples) + " usable samples",
          "at least " + std::to_string(kMinSamples) + ", at different depths and speeds",
          "press deeper, at several speeds, and for longer"};
}

/// rms of x̂/x - 1 beyond a tenth of the deepest displacement.
template <class Estimate>
double relative_error(const std::vector<PalpationSample>& palpation, double min_mm,
                      const Estimate& estimate) {
  double sum = 0.0;
  std::size_t count = 0;
  for (std::size_t i = 0; i < palpation.size(); ++i) {
    const double estimated_mm = estimate(palpation[i]);
    if (!palpation[i].in_contact || palpation[i].displacement_mm < min_mm) continue;
    const double error = estimated_mm / palpation[i].displacement_mm - 1.0;
    sum += error * error;
    ++count;
  }
  return count > 0 ? std::sqrt(sum / static_cast<double>(count)) : 1.0;
}

}  // namespace

hal::Result<rt::IdentifiedLaw<rt::HuntCrossleyParameters>> fit_hunt_crossley(
    const std::vector<PalpationSample>& palpation) {
  const double min_mm = 0.1 * deepest_mm(palpation);
  constexpr double kMinForceN = 0.1;
  constexpr double kMaxRateTerm = 0.1;
  Eigen::Vector3d solution = Eigen::Vector3d::Zero();
  for (int pass = 0; pass < 2; ++pass) {
    Eigen::Matrix3d normal = Eigen::Matrix3d::Zero();
    Eigen::Vector3d right = Eigen::Vector3d::Zero();
    std::size_t used = 0;
    for (const PalpationSample& s : palpation) {
      if (!s.in_contact || s.displacement_mm < min_mm || s.normal_force_n < kMinForceN) continue;
      if (pass == 1 && std::abs(solution(2) * s.rate_mm_per_s) > kMaxRateTerm) continue;
      const Eigen::Vector3d phi(1.0, std::log(s.displacement_mm), s.rate_mm_per_s);
      const double weight = s.normal_force_n * s.normal_force_n;
      normal += weight * phi * phi.transpose();
      right += weight * std::log(s.normal_force_n) * phi;
      ++used;
    }
    const auto factors = normal.ldlt();
    if (used < kMinSamples || !(factors.rcond() > 1e-12)) return too_little(used);
    solution = factors.solve(right);
  }
  rt::IdentifiedLaw<rt::HuntCrossleyParameters> law;
  law.parameters.stiffness_n_per_mm_m = std::exp(solution(0));
  law.parameters.exponent = std::clamp(solution(1), 1.0, 3.0);
  law.parameters.damping_n_s_per_mm_m1 = std::max(0.0, solution(2)) * law.parameters.stiffness_n_per_mm_m;
  law.relative_error =
      std::clamp(relative_error(palpation, min_mm,
                                [&](const PalpationSample& s) {
                                  return rt::hunt_crossley_displacement(law.parameters, s.normal_force_n,
                                                                        s.rate_mm_per_s)
                                      .displacement_mm;
                                }),
                 1e-3, 1.0);
  return law;
}

hal::Result<rt::IdentifiedLaw<rt::CreepParameters>> fit_creep(const std::vector<PalpationSample>& palpation,
                                                              double rate_hz) {
  CreepFit fit(rt::CreepParameters{}.time_s);
  for (const PalpationSample& s : palpation) fit.add(s, 1.0 / rate_hz);
  CreepFit::Options options;
  options.fewest_samples = kMinSamples;
  options.with_errors = false;
  const auto found = fit.solve(options);
  if (!found) return too_little(fit.rows().size());
  rt::IdentifiedLaw<rt::CreepParameters> law = found->law;
  rt::CreepLaw run(law.parameters, rate_hz);
  law.relative_error =
      std::clamp(relative_error(palpation, 0.1 * deepest_mm(palpation),
                                [&](const PalpationSample& s) {
                                  return run.update(s.in_contact ? s.normal_force_n : 0.0).displacement_mm;
                                }),
                 1e-3, 1.0);
  return law;
}

}  // namespace hapticd::identification
