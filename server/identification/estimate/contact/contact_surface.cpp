#include "server/identification/estimate/contact/contact_surface.h"

#include <algorithm>
#include <cmath>

namespace hapticd::identification {

std::optional<SurfaceEstimate> surface_from_first_loading(std::span<const PalpationSample> palpation) {
  const auto begin = std::find_if(palpation.begin(), palpation.end(), [](const PalpationSample& s) {
    return s.in_contact && s.normal_force_n > 0.0;
  });
  if (begin == palpation.end()) return std::nullopt;
  double largest_n = 0.0;
  for (const PalpationSample& s : palpation) largest_n = std::max(largest_n, s.normal_force_n);
  const double up_to_n = std::max(0.1 * largest_n, 3.0 * begin->normal_force_n);
  double n = 0.0, mx = 0.0, mf = 0.0, sxx = 0.0, sxf = 0.0, sff = 0.0, deepest_mm = begin->displacement_mm;
  for (auto s = begin; s != palpation.end(); ++s) {
    if (s->normal_force_n > up_to_n && n >= 5.0) break;
    deepest_mm = std::max(deepest_mm, s->displacement_mm);
    n += 1.0;
    const double dx = s->displacement_mm - mx;
    const double df = s->normal_force_n - mf;
    mx += dx / n;
    mf += df / n;
    sxx += dx * (s->displacement_mm - mx);
    sxf += dx * (s->normal_force_n - mf);
    sff += df * (s->normal_force_n - mf);
  }
  if (n < 5.0 || !(sxx > 0.0) || !(sxf > 0.0)) return std::nullopt;
  SurfaceEstimate found;
  found.force_slope_n_per_mm = sxf / sxx;
  found.surface_mm = mx - mf / found.force_slope_n_per_mm;
  const double variance = std::max(0.0, sff - sxf * sxf / sxx) / (n - 2.0);
  const double lever = found.surface_mm - mx;
  found.standard_error_mm =
      std::sqrt(variance * (1.0 / n + lever * lever / sxx)) / found.force_slope_n_per_mm;
  return found;
}

}  // namespace hapticd::identification
