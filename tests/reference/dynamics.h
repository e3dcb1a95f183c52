#pragma once

#include <array>

#include "hal/phantom/kinematics.h"

namespace hapticd::phantom {

/// Principal moments of inertia in a link's own frame, kg·m²: x across the plane of the arm, y vertical at
/// q = 0, z the third.
struct LinkInertia {
  double mass_kg = 0.0;
  double xx_kg_m2 = 0.0;
  double yy_kg_m2 = 0.0;
  double zz_kg_m2 = 0.0;
};

/// The arm as rigid bodies: the second link (a), the connecting rod parallel to the first (c), the first link
/// with its motor (be), the crank with its motor (df), and the turning base. The last three turn about axes
/// through the origin.
struct ArmInertia {
  LinkInertia second_link;
  LinkInertia rod;
  LinkInertia first_link;
  LinkInertia crank;
  double base_yy_kg_m2 = 0.0;
  double crank_length_m = 0.0;
};

/// Çavuşoğlu, Feygin, Tendick 2002, for the Premium 1.5.
ArmInertia premium_1_5_inertia() noexcept;

/// Joint-space inertia, kg·m².
std::array<std::array<double, 3>, 3> inertia_kg_m2(const ArmGeometry& arm, const ArmInertia& inertia,
                                                   const JointAngles& q) noexcept;

/// What the tip feels like when pushed along a direction (of any length) from a free arm, kg: 1 / (uᵀ J M⁻¹
/// Jᵀ u). Infinite if the arm cannot give.
double apparent_mass_kg(const ArmGeometry& arm, const ArmInertia& inertia, const JointAngles& q,
                        const hal::Vector3& direction) noexcept;

}  // namespace hapticd::phantom
