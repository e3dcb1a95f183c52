#include "hal/sim/object/shape.h"

#include <cmath>
#include <limits>
#include <numbers>

namespace hapticd::sim {

using hal::Vector3;

Projection Plane::project(const Vector3& p) const noexcept {
  return {{p.x, p.y, 0.0}, {0.0, 0.0, 1.0}, -p.z};
}

Projection Sphere::project(const Vector3& p) const noexcept {
  const Vector3 centre{0.0, 0.0, -radius_mm};
  const Vector3 out = p - centre;
  const double distance = std::sqrt(dot(out, out));
  const Vector3 normal = distance > 1e-9 ? out * (1.0 / distance) : Vector3{0.0, 0.0, 1.0};
  return {centre + normal * radius_mm, normal, radius_mm - distance};
}

// Least squared distance over (u, v) by Newton's method: its gradient and Hessian are analytic, and the point
// straight above or below is a good start for gentle slopes. Beyond the radius of curvature the Hessian need
// not be positive definite; Gauss and Newton's is, and halving a step that leads farther away keeps to a
// minimum.
Projection WavyField::project(const Vector3& p) const noexcept {
  const double k = 2.0 * std::numbers::pi / wavelength_mm;
  const double a = amplitude_mm;
  double u = p.x;
  double v = p.y;
  double height = 0.0;
  double hu = 0.0;
  double hv = 0.0;
  double du = 0.0;
  double dv = 0.0;
  double least = std::numeric_limits<double>::infinity();
  const double tolerance = 1e-12 * wavelength_mm;
  for (int iteration = 0; iteration < 60; ++iteration) {
    const double cu = std::cos(k * u), su = std::sin(k * u);
    const double cv = std::cos(k * v), sv = std::sin(k * v);
    height = a * (cu * cv - 1.0);
    hu = -a * k * su * cv;
    hv = -a * k * cu * sv;
    const double huu = -a * k * k * cu * cv;
    const double huv = a * k * k * su * sv;
    const double rise = height - p.z;
    const double squared = (u - p.x) * (u - p.x) + (v - p.y) * (v - p.y) + rise * rise;
    if (squared > least * (1.0 + 1e-14)) {
      du *= 0.5;
      dv *= 0.5;
      u += du;
      v += dv;
      if (std::abs(du) + std::abs(dv) < tolerance) break;
      continue;
    }
    least = squared;
    const double gu = (u - p.x) + rise * hu;
    const double gv = (v - p.y) + rise * hv;
    double auu = 1.0 + hu * hu + rise * huu;
    double avv = 1.0 + hv * hv + rise * huu;  // h_vv equals h_uu for this field
    double auv = hu * hv + rise * huv;
    if (!(auu > 0.0 && auu * avv - auv * auv > 1e-3 * auu * auu)) {
      auu = 1.0 + hu * hu;
      avv = 1.0 + hv * hv;
      auv = hu * hv;
    }
    const double determinant = auu * avv - auv * auv;
    du = (avv * gu - auv * gv) / determinant;
    dv = (auu * gv - auv * gu) / determinant;
    u -= du;
    v -= dv;
    if (std::abs(du) + std::abs(dv) < tolerance) break;
  }
  const double length = std::sqrt(1.0 + hu * hu + hv * hv);
  const Vector3 normal{-hu / length, -hv / length, 1.0 / length};
  const Vector3 point{u, v, height};
  return {point, normal, dot(point - p, normal)};
}

// In the plane across the edge, from the centre of the round. Above its two radii at 45° the round is
// nearest, anywhere else the face of the point's own side.
Projection Ridge::project(const Vector3& p) const noexcept {
  const double side = std::signbit(p.x) ? -1.0 : 1.0;
  const double x = std::abs(p.x);
  const double z = p.z + radius_mm;
  if (z > x) {
    const double distance = std::hypot(x, z);
    const Vector3 normal{p.x / distance, 0.0, z / distance};
    return {{normal.x * radius_mm, p.y, normal.z * radius_mm - radius_mm}, normal, radius_mm - distance};
  }
  constexpr double kHalfRoot = 0.5 * std::numbers::sqrt2;
  const double depth = radius_mm - (x + z) * kHalfRoot;
  const Vector3 normal{side * kHalfRoot, 0.0, kHalfRoot};
  return {p + normal * depth, normal, depth};
}

}  // namespace hapticd::sim
