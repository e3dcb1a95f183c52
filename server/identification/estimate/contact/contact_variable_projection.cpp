#include "server/identification/estimate/contact/contact_variable_projection.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

namespace hapticd::identification {

namespace {

struct Row {
  double displacement_mm, rate_mm_per_s, force_n;
};

/// K and B of an exponent, and what they leave.
struct Linear {
  double stiffness = 0.0, damping = 0.0;
  double squared_n2 = std::numeric_limits<double>::infinity();
};

Linear solve(const std::vector<Row>& rows, const std::vector<double>& log_x, double exponent) {
  double gg = 0.0, gh = 0.0, hh = 0.0, gf = 0.0, hf = 0.0, ff = 0.0;
  for (std::size_t i = 0; i < rows.size(); ++i) {
    const double g = std::exp(exponent * log_x[i]);
    const double h = g * rows[i].rate_mm_per_s;
    const double f = rows[i].force_n;
    gg += g * g;
    gh += g * h;
    hh += h * h;
    gf += g * f;
    hf += h * f;
    ff += f * f;
  }
  Linear found;
  if (!(gg > 0.0)) return found;
  const double determinant = gg * hh - gh * gh;
  if (determinant > 1e-9 * gg * hh) {
    found.damping = std::max(0.0, (gg * hf - gh * gf) / determinant);
  }
  found.stiffness = (gf - found.damping * gh) / gg;
  if (!(found.stiffness > 0.0)) {
    // At one speed nothing distinguishes damping from stiffness.
    found.damping = 0.0;
    found.stiffness = gf / gg;
  }
  const double k = found.stiffness;
  const double b = found.damping;
  found.squared_n2 = ff - 2.0 * (k * gf + b * hf) + k * k * gg + 2.0 * k * b * gh + b * b * hh;
  return found;
}

}  // namespace

std::optional<HuntCrossleyEstimate> fit_by_variable_projection(std::span<const PalpationSample> palpation,
                                                               const VariableProjectionOptions& options) {
  std::vector<Row> rows;
  rows.reserve(palpation.size());
  double shallowest_mm = std::numeric_limits<double>::infinity();
  double deepest_mm = 0.0;
  for (const PalpationSample& s : palpation) {
    if (!identifies_contact(s, options.max_offset_mm) || !std::isfinite(s.displacement_mm) ||
        !std::isfinite(s.rate_mm_per_s) || !std::isfinite(s.normal_force_n)) {
      continue;
    }
    rows.push_back({s.displacement_mm, s.rate_mm_per_s, s.normal_force_n});
    shallowest_mm = std::min(shallowest_mm, s.displacement_mm);
    deepest_mm = std::max(deepest_mm, s.displacement_mm);
  }
  if (rows.size() < options.fewest_samples || !(deepest_mm - shallowest_mm > 0.02 * deepest_mm))
    return std::nullopt;

  std::vector<double> log_x(rows.size());
  const auto shift = [&](double offset_mm) {
    for (std::size_t i = 0; i < rows.size(); ++i) {
      log_x[i] = std::log(std::max(1e-6 * deepest_mm, rows[i].displacement_mm + offset_mm));
    }
  };
  const auto best_exponent = [&](double tolerance) {
    return search_minimum(1.0, 3.0, 8, tolerance, [&](double m) { return solve(rows, log_x, m).squared_n2; });
  };
  double offset_mm = 0.0;
  const double span_mm = options.max_offset_mm - options.min_offset_mm;
  if (span_mm > 0.0) {
    offset_mm =
        search_minimum(options.min_offset_mm, options.max_offset_mm, 8, 1e-3 * span_mm, [&](double trial_mm) {
          shift(trial_mm);
          return solve(rows, log_x, best_exponent(1e-3)).squared_n2;
        });
  }
  shift(offset_mm);
  HuntCrossleyEstimate estimate;
  estimate.parameters.exponent = best_exponent(1e-5);
  const Linear linear = solve(rows, log_x, estimate.parameters.exponent);
  if (!(linear.stiffness > 0.0) || !std::isfinite(linear.stiffness)) return std::nullopt;
  estimate.parameters.stiffness_n_per_mm_m = linear.stiffness;
  estimate.parameters.damping_n_s_per_mm_m1 = linear.damping;
  estimate.contact_offset_mm = offset_mm;
  estimate.samples = rows.size();
  return estimate;
}

}  // namespace hapticd::identification
