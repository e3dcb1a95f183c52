#pragma once

#include <optional>
#include <span>

#include "server/identification/estimate/contact/contact_estimate.h"

namespace hapticd::identification {

/// Batch fit of (4.22) to the force by variable projection (Golub and Pereyra 1973): for a given exponent K
/// and B ≥ 0 follow by linear least squares, and what they leave is a function of the exponent alone, which
/// is searched within 1 … 3. If offsets are allowed, the surface may lie that far before the samples' zero
/// (or behind it, if negative), and the offset is searched as well. None if fewer than `fewest_samples`
/// samples show anything, or all lie at one displacement.
struct VariableProjectionOptions {
  double min_offset_mm = 0.0;
  double max_offset_mm = 0.0;
  std::size_t fewest_samples = 30;
};
std::optional<HuntCrossleyEstimate> fit_by_variable_projection(std::span<const PalpationSample> palpation,
                                                               const VariableProjectionOptions& options = {});

/// Finds the minimum of a function of one variable that has one valley near the best of a coarse look, by
/// golden section to `tolerance`.
template <class Function>
double search_minimum(double from, double to, int looks, double tolerance, const Function& function) {
  double best = from;
  double least = function(from);
  const double step = (to - from) / looks;
  for (int i = 1; i <= looks; ++i) {
    const double at = from + step * i;
    const double value = function(at);
    if (value < least) {
      least = value;
      best = at;
    }
  }
  constexpr double kGolden = 0.6180339887498949;
  double a = best - step < from ? from : best - step;
  double b = best + step > to ? to : best + step;
  double c = b - kGolden * (b - a);
  double d = a + kGolden * (b - a);
  double at_c = function(c);
  double at_d = function(d);
  while (b - a > tolerance) {
    if (at_c < at_d) {
      b = d;
      d = c;
      at_d = at_c;
      c = b - kGolden * (b - a);
      at_c = function(c);
    } else {
      a = c;
      c = d;
      at_c = at_d;
      d = a + kGolden * (b - a);
      at_d = function(d);
    }
  }
  const double middle = 0.5 * (a + b);
  return function(middle) <= least ? middle : best;
}

}  // namespace hapticd::identification
