#include "rt/target/target_law.h"

#include <algorithm>
#include <cmath>
#include <sstream>

namespace hapticd::rt {

namespace {

double interpolated(const TargetLaw& law, double at_mm) noexcept {
  const auto& knots = law.knots;
  if (law.knot_count == 0) return 0.0;
  if (at_mm <= knots[0].at_mm) return knots[0].stiffness_n_per_mm;
  for (std::uint32_t i = 1; i < law.knot_count; ++i) {
    if (at_mm > knots[i].at_mm) continue;
    const double share = (at_mm - knots[i - 1].at_mm) / (knots[i].at_mm - knots[i - 1].at_mm);
    return knots[i - 1].stiffness_n_per_mm +
           share * (knots[i].stiffness_n_per_mm - knots[i - 1].stiffness_n_per_mm);
  }
  return knots[law.knot_count - 1].stiffness_n_per_mm;
}

/// ∫ k~ from 0 to x, exact: trapezia between the knots.
double integrated(const TargetLaw& law, double displacement_mm) noexcept {
  double force_n = 0.0;
  double from_mm = 0.0;
  double from_n_per_mm = interpolated(law, 0.0);
  for (std::uint32_t i = 0; i < law.knot_count && from_mm < displacement_mm; ++i) {
    if (law.knots[i].at_mm <= from_mm) continue;
    const double to_mm = std::min(displacement_mm, law.knots[i].at_mm);
    const double to_n_per_mm = interpolated(law, to_mm);
    force_n += 0.5 * (from_n_per_mm + to_n_per_mm) * (to_mm - from_mm);
    from_mm = to_mm;
    from_n_per_mm = to_n_per_mm;
  }
  return force_n + from_n_per_mm * (displacement_mm - from_mm);
}

}  // namespace

double TargetLaw::force_n(double displacement_mm, double rate_mm_per_s, const hal::Vector3& tip_mm,
                          double max_damping_n_s_per_mm) const noexcept {
  const double x = std::max(0.0, displacement_mm);
  switch (kind) {
    case Kind::kLinear:
      return stiffness_n_per_mm * x;
    case Kind::kHuntCrossley:
      if (!(x > 0.0)) return 0.0;
      {
        const double power = std::pow(x, hunt_crossley.exponent);
        const double damping = std::min(hunt_crossley.damping_n_s_per_mm_m1 * power, max_damping_n_s_per_mm);
        return std::max(0.0, hunt_crossley.stiffness_n_per_mm_m * power + damping * rate_mm_per_s);
      }
    case Kind::kDisplacementProfile:
      return integrated(*this, x);
    case Kind::kPositionProfile:
      return interpolated(*this, dot(axis, tip_mm)) * x;
  }
  return 0.0;
}

double greatest_stiffness_n_per_mm(const TargetLaw& law, double max_displacement_mm) noexcept {
  switch (law.kind) {
    case TargetLaw::Kind::kLinear:
      return law.stiffness_n_per_mm;
    case TargetLaw::Kind::kHuntCrossley:
      return law.hunt_crossley.exponent * law.hunt_crossley.stiffness_n_per_mm_m *
             std::pow(std::max(1.0, max_displacement_mm), law.hunt_crossley.exponent - 1.0);
    default:
      break;
  }
  double greatest = 0.0;
  for (std::uint32_t i = 0; i < law.knot_count; ++i) {
    greatest = std::max(greatest, law.knots[i].stiffness_n_per_mm);
  }
  return greatest;
}

double damping_n_s_per_mm(const TargetLaw& law, double displacement_mm) noexcept {
  if (law.kind != TargetLaw::Kind::kHuntCrossley || !(displacement_mm > 0.0)) return 0.0;
  const HuntCrossleyParameters& p = law.hunt_crossley;
  return std::min(p.damping_n_s_per_mm_m1 * std::pow(displacement_mm, p.exponent), kMaxTargetDampingNsPerMm);
}

std::optional<hal::Error> check(TargetLaw& law, const std::string& where) {
  std::optional<hal::Error> error;
  const auto range = [&](const std::string& key, double value, double low, double high,
                         const std::string& unit) {
    if (error || (value >= low && value <= high)) return;
    std::ostringstream shown, limit;
    shown << value;
    limit << low << " … " << high << " " << unit;
    error = hal::Error::of(hal::ErrorCode::kOutOfRange, key + " is out of range", where, shown.str(),
                           limit.str(), "");
  };
  switch (law.kind) {
    case TargetLaw::Kind::kLinear:
      range("stiffness_n_per_mm", law.stiffness_n_per_mm, 0.0, 1000.0, "N/mm");
      break;
    case TargetLaw::Kind::kHuntCrossley:
      range("hunt_crossley.stiffness_n_per_mm_m", law.hunt_crossley.stiffness_n_per_mm_m, 0.0, 1000.0,
            "N/mm^m");
      range("hunt_crossley.damping_n_s_per_mm_m1", law.hunt_crossley.damping_n_s_per_mm_m1, 0.0,
            kMaxTargetDampingNsPerMm, "N·s/mm^(m+1) (more is not passive at the loop's rate)");
      range("hunt_crossley.exponent", law.hunt_crossley.exponent, 1.0, 3.0, "");
      break;
    case TargetLaw::Kind::kDisplacementProfile:
    case TargetLaw::Kind::kPositionProfile: {
      range("profile's number of knots", law.knot_count, 1.0, TargetLaw::kMaxKnots, "");
      const double lowest_mm = law.kind == TargetLaw::Kind::kDisplacementProfile ? 0.0 : -1000.0;
      for (std::uint32_t i = 0; !error && i < law.knot_count; ++i) {
        const std::string knot = "knot " + std::to_string(i + 1);
        range(knot + ", at_mm (rising)", law.knots[i].at_mm,
              i == 0 ? lowest_mm : law.knots[i - 1].at_mm + 1e-6, 1000.0, "mm");
        range(knot + ", stiffness_n_per_mm", law.knots[i].stiffness_n_per_mm, 0.0, 1000.0, "N/mm");
      }
      const double length = std::sqrt(dot(law.axis, law.axis));
      range("axis' length", length, 1e-6, 1e6, "");
      if (!error) law.axis = law.axis * (1.0 / length);
      break;
    }
  }
  return error;
}

}  // namespace hapticd::rt
