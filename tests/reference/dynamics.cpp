#include "tests/reference/dynamics.h"

#include <cmath>
#include <limits>

namespace hapticd::phantom {

namespace {
constexpr double kMPerMm = 1e-3;
constexpr double kE4 = 1e-4;

double squared(double x) noexcept {
  return x * x;
}

/// About the vertical, of a link tilted by the angle from its pose at q = 0.
double about_vertical_kg_m2(const LinkInertia& link, double angle_rad) noexcept {
  return link.yy_kg_m2 * squared(std::cos(angle_rad)) + link.zz_kg_m2 * squared(std::sin(angle_rad));
}
}  // namespace

ArmInertia premium_1_5_inertia() noexcept {
  return {.second_link = {0.0202, 0.4864 * kE4, 0.001843 * kE4, 0.4864 * kE4},
          .rod = {0.0249, 0.959 * kE4, 0.959 * kE4, 0.0051 * kE4},
          .first_link = {0.2359, 11.09 * kE4, 10.06 * kE4, 0.591 * kE4},
          .crank = {0.1906, 7.11 * kE4, 0.629 * kE4, 6.246 * kE4},
          .base_yy_kg_m2 = 11.87 * kE4,
          .crank_length_m = 0.0325};
}

// Kinetic energy of the five bodies. The second link's centre is half-way along it, beyond the elbow; the
// rod's is half-way along the first link, carried sideways by the crank.
std::array<std::array<double, 3>, 3> inertia_kg_m2(const ArmGeometry& arm, const ArmInertia& inertia,
                                                   const JointAngles& q) noexcept {
  const double l1 = kMPerMm * arm.first_link_mm;
  const double l2 = kMPerMm * arm.second_link_mm;
  const double l3 = inertia.crank_length_m;
  const double ma = inertia.second_link.mass_kg;
  const double mc = inertia.rod.mass_kg;
  const double c2 = std::cos(q[1]);
  const double s3 = std::sin(q[2]);

  const double m11 = inertia.base_yy_kg_m2 + about_vertical_kg_m2(inertia.first_link, q[1]) +
                     about_vertical_kg_m2(inertia.rod, q[1]) +
                     about_vertical_kg_m2(inertia.second_link, q[2]) +
                     about_vertical_kg_m2(inertia.crank, q[2]) + ma * squared(l1 * c2 + 0.5 * l2 * s3) +
                     mc * squared(0.5 * l1 * c2 + l3 * s3);
  const double m22 =
      inertia.first_link.xx_kg_m2 + inertia.rod.xx_kg_m2 + ma * squared(l1) + mc * squared(0.5 * l1);
  const double m33 =
      inertia.second_link.xx_kg_m2 + inertia.crank.xx_kg_m2 + ma * squared(0.5 * l2) + mc * squared(l3);
  const double m23 = -0.5 * l1 * (l2 * ma + l3 * mc) * std::sin(q[1] - q[2]);
  return {{{m11, 0.0, 0.0}, {0.0, m22, m23}, {0.0, m23, m33}}};
}

double apparent_mass_kg(const ArmGeometry& arm, const ArmInertia& inertia, const JointAngles& q,
                        const hal::Vector3& direction) noexcept {
  const double length = std::sqrt(dot(direction, direction));
  const auto m = inertia_kg_m2(arm, inertia, q);
  // Torques of a unit force along the direction, N·m per N.
  std::array<double, 3> t = torques_for_n_mm(arm, q, direction * (kMPerMm / length));
  const double determinant = m[1][1] * m[2][2] - m[1][2] * m[1][2];
  const double mobility =
      t[0] * t[0] / m[0][0] +
      (m[2][2] * t[1] * t[1] - 2.0 * m[1][2] * t[1] * t[2] + m[1][1] * t[2] * t[2]) / determinant;
  return mobility > 0.0 ? 1.0 / mobility : std::numeric_limits<double>::infinity();
}

}  // namespace hapticd::phantom
