#include "rt/model/structural_model.h"

namespace hapticd::rt {

double StructuralModel::relative_compliance(const hal::Vector3& position_mm) const noexcept {
  const hal::Vector3 q = position_mm - centre_mm;
  const auto& h = curvature_per_mm2;
  const double bend = h[0] * q.x * q.x + h[1] * q.y * q.y + h[2] * q.z * q.z +
                      2.0 * (h[3] * q.x * q.y + h[4] * q.x * q.z + h[5] * q.y * q.z);
  return 1.0 + dot(gradient_per_mm, q) + bend;
}

double StructuralModel::stiffness_at(const hal::Vector3& position_mm) const noexcept {
  // Far outside the places tapped at the polynomial means nothing: held within a factor of two.
  const double relative = relative_compliance(position_mm);
  constexpr double kMin = 1.0 / kMaxRatio;
  // A place that is not a number is as stiff as any: no field makes a deflection infinite.
  return stiffness_n_per_mm / (relative > kMaxRatio ? kMaxRatio : relative > kMin ? relative : kMin);
}

std::array<hal::Vector3, 8> StructuralModel::corners_mm() const noexcept {
  std::array<hal::Vector3, 8> corners;
  for (unsigned i = 0; i < corners.size(); ++i) {
    corners[i] = {(i & 1U) != 0 ? covered_to_mm.x : covered_from_mm.x,
                  (i & 2U) != 0 ? covered_to_mm.y : covered_from_mm.y,
                  (i & 4U) != 0 ? covered_to_mm.z : covered_from_mm.z};
  }
  return corners;
}

}  // namespace hapticd::rt
