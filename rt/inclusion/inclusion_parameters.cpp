#include "rt/inclusion/inclusion_parameters.h"

#include <string>

#include "rt/signal/vector.h"

namespace hapticd::rt {

std::optional<hal::Error> check(const InclusionParameters& inclusion, const std::string& prefix,
                                const std::string& where) {
  struct Range {
    const char* key;
    double value, low, high;
    const char* unit;
  };
  const HuntCrossleyParameters& law = inclusion.response;
  const double l0_mm = norm(inclusion.place_mm - inclusion.surface_mm);
  for (const Range& r : {
           Range{"depth (from surface_mm to place_mm)", l0_mm, 2.0, 200.0, "mm"},
           Range{"stiffness_n_per_mm_m", law.stiffness_n_per_mm_m, 1e-6, 1e3, "N/mm^m"},
           Range{"damping_n_s_per_mm_m1", law.damping_n_s_per_mm_m1, 0.0, 10.0, "N·s/mm^(m+1)"},
           Range{"exponent", law.exponent, 1.0, 4.0, ""},
           Range{"max_displacement_mm", inclusion.max_displacement_mm, 0.5, 100.0, "mm"},
           Range{"attenuation", inclusion.attenuation, 2.0, 12.0, ""},
           Range{"approach", inclusion.approach, 0.0, 0.9, ""},
           Range{"internal_friction", inclusion.internal_friction, 0.0, 1.0, ""},
           Range{"internal_presliding_mm", inclusion.internal_presliding_mm, 0.01, 10.0, "mm"},
       }) {
    if (r.value >= r.low && r.value <= r.high) continue;
    return hal::Error::of(hal::ErrorCode::kOutOfRange, prefix + r.key + " is out of range", where,
                          std::to_string(r.value),
                          std::to_string(r.low) + " … " + std::to_string(r.high) + " " + r.unit, "");
  }
  return std::nullopt;
}

}  // namespace hapticd::rt
