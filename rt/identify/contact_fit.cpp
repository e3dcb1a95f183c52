#include "rt/identify/contact_fit.h"

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

namespace hapticd::rt {

namespace {

constexpr std::size_t kFewestSamples = 100;

double deepest_mm(const std::vector<PalpationSample>& palpation) {
  double deepest = 0.0;
  for (const PalpationSample& s : palpation) {
    if (s.in_contact) deepest = std::max(deepest, s.displacement_mm);
  }
  return deepest;
}

hal::Error too_little(std::size_t samples) {
  return {"the palpation does not tell the model's parameters", "identification of the contact law",
          std::to_string(samples) + " usable samples",
          "at least " + std::to_string(kFewestSamples) + ", at different depths and speeds",
          "press deeper, at several speeds, and for longer"};
}

/// rms of x̂/x - 1 beyond a tenth of the deepest displacement.
template <class Estimate>
double relative_error(const std::vector<PalpationSample>& palpation, double least_mm,
                      const Estimate& estimate) {
  double sum = 0.0;
  std::size_t count = 0;
  for (std::size_t i = 0; i < palpation.size(); ++i) {
    const double estimated_mm = estimate(palpation[i]);
    if (!palpation[i].in_contact || palpation[i].displacement_mm < least_mm) continue;
    const double error = estimated_mm / palpation[i].displacement_mm - 1.0;
    sum += error * error;
    ++count;
  }
  return count > 0 ? std::sqrt(sum / static_cast<double>(count)) : 1.0;
}

/// min |A y - b| with y ≥ 0 from the normal equations: Lawson and Hanson's active set.
Eigen::VectorXd non_negative_least_squares(const Eigen::MatrixXd& ata, const Eigen::VectorXd& atb) {
  const Eigen::Index n = atb.size();
  Eigen::VectorXd y = Eigen::VectorXd::Zero(n);
  std::vector<bool> free(static_cast<std::size_t>(n), false);
  const auto is_free = [&](Eigen::Index i) { return free[static_cast<std::size_t>(i)]; };
  const auto solve_free = [&] {
    std::vector<Eigen::Index> index;
    for (Eigen::Index i = 0; i < n; ++i) {
      if (is_free(i)) index.push_back(i);
    }
    Eigen::VectorXd s = Eigen::VectorXd::Zero(n);
    if (index.empty()) return s;
    const Eigen::MatrixXd part = ata(index, index);
    const Eigen::VectorXd solution = part.ldlt().solve(atb(index));
    for (std::size_t i = 0; i < index.size(); ++i) s(index[i]) = solution(static_cast<Eigen::Index>(i));
    return s;
  };
  for (Eigen::Index outer = 0; outer < 3 * n; ++outer) {
    const Eigen::VectorXd gradient = atb - ata * y;
    Eigen::Index enter = -1;
    double steepest = 1e-10 * atb.cwiseAbs().maxCoeff();
    for (Eigen::Index i = 0; i < n; ++i) {
      if (!is_free(i) && gradient(i) > steepest) {
        steepest = gradient(i);
        enter = i;
      }
    }
    if (enter < 0) break;
    free[static_cast<std::size_t>(enter)] = true;
    for (Eigen::Index inner = 0; inner < n; ++inner) {
      const Eigen::VectorXd s = solve_free();
      double step = 1.0;
      for (Eigen::Index i = 0; i < n; ++i) {
        if (is_free(i) && s(i) <= 0.0) step = std::min(step, y(i) / (y(i) - s(i)));
      }
      y += step * (s - y);
      if (step >= 1.0) break;
      for (Eigen::Index i = 0; i < n; ++i) {
        if (is_free(i) && y(i) <= 1e-14) {
          free[static_cast<std::size_t>(i)] = false;
          y(i) = 0.0;
        }
      }
    }
  }
  return y;
}

/// The creep law's inner problem: Ψ for given weights.
class CreepFit {
 public:
  CreepFit(const std::vector<PalpationSample>& palpation, double rate_hz) {
    deepest_mm_ = deepest_mm(palpation);
    const CreepParameters defaults;
    std::array<double, CreepParameters::kLags> lagged{};
    constexpr std::size_t kEvery = 3;  // the fit gains nothing from every tick
    for (std::size_t i = 0; i < palpation.size(); ++i) {
      const double force_n = palpation[i].in_contact ? std::max(0.0, palpation[i].normal_force_n) : 0.0;
      for (std::size_t l = 0; l < lagged.size(); ++l) {
        lagged[l] = force_n + (lagged[l] - force_n) * std::exp(-1.0 / (defaults.time_s[l] * rate_hz));
      }
      if (i % kEvery != 0 || !palpation[i].in_contact || palpation[i].displacement_mm < 0.01 * deepest_mm_) {
        continue;
      }
      Row row;
      row.force_n[0] = force_n;
      std::copy(lagged.begin(), lagged.end(), row.force_n.begin() + 1);
      row.displacement_mm = palpation[i].displacement_mm;
      row.weight = 1.0 / (row.displacement_mm + 0.05 * deepest_mm_);
      rows_.push_back(row);
      largest_n_ = std::max(largest_n_, force_n);
    }
  }

  std::size_t samples() const { return rows_.size(); }

  /// Mean squared relative error; fills in Ψ.
  double fit_curve(CreepParameters& parameters) const {
    double sum = 0.0;
    for (const double w : parameters.weight) sum += w;
    std::vector<double> effective(rows_.size());
    double largest = 0.0;
    for (std::size_t i = 0; i < rows_.size(); ++i) {
      for (std::size_t j = 0; j < parameters.weight.size(); ++j) {
        effective[i] += parameters.weight[j] / sum * rows_[i].force_n[j];
      }
      largest = std::max(largest, effective[i]);
    }
    parameters.max_force_n = largest;

    constexpr Eigen::Index kSteps = CreepParameters::kKnots - 1;
    Eigen::MatrixXd ata = Eigen::MatrixXd::Zero(kSteps, kSteps);
    Eigen::VectorXd atb = Eigen::VectorXd::Zero(kSteps);
    double btb = 0.0;
    for (std::size_t i = 0; i < rows_.size(); ++i) {
      const double at = kSteps * std::sqrt(effective[i] / largest);
      const auto j = std::min<Eigen::Index>(static_cast<Eigen::Index>(at), kSteps - 1);
      const auto knot = [&](Eigen::Index k) {
        const double share = static_cast<double>(k) / kSteps;
        return largest * share * share;
      };
      const double t = (effective[i] - knot(j)) / (knot(j + 1) - knot(j));
      // x = Σ_{k<j} step_k + t step_j: straight between the knots, close enough to the cubic for a fit.
      const double w2 = rows_[i].weight * rows_[i].weight;
      const double b = rows_[i].displacement_mm;
      btb += w2 * b * b;
      for (Eigen::Index k = 0; k <= j; ++k) {
        const double ak = k < j ? 1.0 : t;
        atb(k) += w2 * ak * b;
        for (Eigen::Index l = 0; l <= k; ++l) ata(k, l) += w2 * ak;  // a_l = 1 below the diagonal
        if (k == j) ata(k, k) += w2 * (t * t - ak);
      }
    }
    ata.triangularView<Eigen::StrictlyUpper>() = ata.transpose();
    // Knots that no sample determines take the slope of their neighbours.
    const double slight = 1e-6 * ata.trace() / kSteps;
    Eigen::MatrixXd regular = ata;
    for (Eigen::Index k = 0; k + 1 < kSteps; ++k) {
      const double a = 1.0 / static_cast<double>(2 * k + 1);
      const double c = 1.0 / static_cast<double>(2 * k + 3);
      regular(k, k) += slight * a * a;
      regular(k + 1, k + 1) += slight * c * c;
      regular(k, k + 1) -= slight * a * c;
      regular(k + 1, k) -= slight * a * c;
    }
    const Eigen::VectorXd steps = non_negative_least_squares(regular, atb);
    double x = 0.0;
    for (Eigen::Index k = 0; k < kSteps; ++k) {
      x += std::max(steps(k), 1e-6 * deepest_mm_);
      parameters.displacement_mm[static_cast<std::size_t>(k) + 1] = x;
    }
    const double squared = btb - 2.0 * steps.dot(atb) + steps.dot(ata * steps);
    return squared / static_cast<double>(rows_.size());
  }

 private:
  struct Row {
    std::array<double, CreepParameters::kLags + 1> force_n{};
    double displacement_mm = 0.0;
    double weight = 1.0;
  };
  std::vector<Row> rows_;
  double deepest_mm_ = 0.0;
  double largest_n_ = 0.0;
};

}  // namespace

hal::Result<IdentifiedLaw<HuntCrossleyParameters>> fit_hunt_crossley(
    const std::vector<PalpationSample>& palpation) {
  const double least_mm = 0.1 * deepest_mm(palpation);
  constexpr double kLeastForceN = 0.1;
  constexpr double kLargestRateTerm = 0.1;
  Eigen::Vector3d solution = Eigen::Vector3d::Zero();
  for (int pass = 0; pass < 2; ++pass) {
    Eigen::Matrix3d normal = Eigen::Matrix3d::Zero();
    Eigen::Vector3d right = Eigen::Vector3d::Zero();
    std::size_t used = 0;
    for (const PalpationSample& s : palpation) {
      if (!s.in_contact || s.displacement_mm < least_mm || s.normal_force_n < kLeastForceN) continue;
      if (pass == 1 && std::abs(solution(2) * s.rate_mm_per_s) > kLargestRateTerm) continue;
      const Eigen::Vector3d phi(1.0, std::log(s.displacement_mm), s.rate_mm_per_s);
      const double weight = s.normal_force_n * s.normal_force_n;
      normal += weight * phi * phi.transpose();
      right += weight * std::log(s.normal_force_n) * phi;
      ++used;
    }
    const auto factors = normal.ldlt();
    if (used < kFewestSamples || !(factors.rcond() > 1e-12)) return too_little(used);
    solution = factors.solve(right);
  }
  IdentifiedLaw<HuntCrossleyParameters> law;
  law.parameters.stiffness_n_per_mm_m = std::exp(solution(0));
  law.parameters.exponent = std::clamp(solution(1), 1.0, 3.0);
  law.parameters.damping_n_s_per_mm_m1 = std::max(0.0, solution(2)) * law.parameters.stiffness_n_per_mm_m;
  law.relative_error = std::clamp(
      relative_error(palpation, least_mm,
                     [&](const PalpationSample& s) {
                       return hunt_crossley_displacement(law.parameters, s.normal_force_n, s.rate_mm_per_s)
                           .displacement_mm;
                     }),
      1e-3, 1.0);
  return law;
}

hal::Result<IdentifiedLaw<CreepParameters>> fit_creep(const std::vector<PalpationSample>& palpation,
                                                      double rate_hz) {
  const CreepFit fit(palpation, rate_hz);
  if (fit.samples() < kFewestSamples) return too_little(fit.samples());
  CreepParameters best;
  best.weight = {0.6, 0.1, 0.1, 0.1, 0.1};
  double least = fit.fit_curve(best);
  // The error is smooth in the four free weights: a pattern search that halves its step finds the valley.
  for (double step = 0.1; step > 1e-3; step *= 0.5) {
    for (bool better = true; better;) {
      better = false;
      for (std::size_t j = 0; j < best.weight.size(); ++j) {
        for (const double sign : {1.0, -1.0}) {
          CreepParameters trial = best;
          trial.weight[j] = std::max(0.0, trial.weight[j] + sign * step);
          double sum = 0.0;
          for (const double w : trial.weight) sum += w;
          if (!(sum > 0.0) || trial.weight[0] / sum < 0.05) continue;
          for (double& w : trial.weight) w /= sum;
          const double error = fit.fit_curve(trial);
          if (error < least * (1.0 - 1e-4)) {
            least = error;
            best = trial;
            better = true;
          }
        }
      }
    }
  }
  IdentifiedLaw<CreepParameters> law{best};
  CreepLaw run(best, rate_hz);
  law.relative_error =
      std::clamp(relative_error(palpation, 0.1 * deepest_mm(palpation),
                                [&](const PalpationSample& s) {
                                  return run.update(s.in_contact ? s.normal_force_n : 0.0).displacement_mm;
                                }),
                 1e-3, 1.0);
  return law;
}

}  // namespace hapticd::rt
