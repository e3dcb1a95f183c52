#include "tests/measure/study/extremes/spectral_radius.h"

#include <algorithm>
#include <cmath>
#include <complex>
#include <cstddef>

namespace hapticd::study::extremes {

double spectral_radius(std::span<const double> course) {
  // What has come down to rounding says nothing.
  double largest = 0.0;
  for (const double y : course) {
    if (std::isfinite(y)) largest = std::max(largest, std::abs(y));
  }
  // Each row is scaled, or the last ones of a course that diverges would be all that counts.
  double s11 = 0.0, s12 = 0.0, s22 = 0.0, t1 = 0.0, t2 = 0.0, yy = 0.0;
  for (std::size_t k = 2; k < course.size(); ++k) {
    const double size = std::abs(course[k - 1]) + std::abs(course[k - 2]);
    if (!(size > 1e-8 * largest) || !std::isfinite(size) || !std::isfinite(course[k])) continue;
    const double p = course[k - 1] / size, q = course[k - 2] / size, y = course[k] / size;
    s11 += p * p;
    s12 += p * q;
    s22 += q * q;
    t1 += p * y;
    t2 += q * y;
    yy += y * y;
  }
  if (!(s11 > 0.0)) return 0.0;
  // A course of first order: one coefficient says it all, and the second would be made of rounding.
  const double left = yy - t1 * t1 / s11;
  const double determinant = s11 * s22 - s12 * s12;
  if (left < 1e-8 * yy || !(determinant > 1e-12 * s11 * s22)) return std::abs(t1 / s11);
  const double a = (t1 * s22 - t2 * s12) / determinant;
  const double b = (t2 * s11 - t1 * s12) / determinant;
  const std::complex<double> root = std::sqrt(std::complex<double>(0.25 * a * a + b));
  return std::max(std::abs(0.5 * a + root), std::abs(0.5 * a - root));
}

}  // namespace hapticd::study::extremes
