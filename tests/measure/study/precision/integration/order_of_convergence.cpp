#include "tests/measure/study/precision/integration/order_of_convergence.h"

#include <cmath>
#include <cstddef>

namespace hapticd::study {

std::optional<double> order_of_convergence(const std::vector<double>& steps,
                                           const std::vector<double>& errors, double floor) {
  double n = 0.0, sx = 0.0, sy = 0.0, sxx = 0.0, sxy = 0.0;
  for (std::size_t i = 0; i < steps.size() && i < errors.size(); ++i) {
    if (!(errors[i] > floor) || !std::isfinite(errors[i])) continue;
    const double x = std::log(steps[i]);
    const double y = std::log(errors[i]);
    n += 1.0;
    sx += x;
    sy += y;
    sxx += x * x;
    sxy += x * y;
  }
  const double spread = n * sxx - sx * sx;
  if (n < 2.0 || spread <= 0.0) return std::nullopt;
  return (n * sxy - sx * sy) / spread;
}

}  // namespace hapticd::study
