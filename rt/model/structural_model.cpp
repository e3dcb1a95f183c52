#include "rt/model/structural_model.h"

namespace hapticd::rt {

double StructuralModel::stiffness_at(const hal::Vector3& position_mm) const noexcept {
  const hal::Vector3 q = position_mm - centre_mm;
  const auto& h = curvature_per_mm2;
  const double bend = h[0] * q.x * q.x + h[1] * q.y * q.y + h[2] * q.z * q.z +
                      2.0 * (h[3] * q.x * q.y + h[4] * q.x * q.z + h[5] * q.y * q.z);
  // Far outside the places tapped at the polynomial means nothing: held within a factor of two.
  const double relative = 1.0 + dot(gradient_per_mm, q) + bend;
  // A place that is no number is as soft as any: no field makes a deflection infinite.
  return stiffness_n_per_mm / (relative > 2.0 ? 2.0 : relative > 0.5 ? relative : 0.5);
}

}  // namespace hapticd::rt
