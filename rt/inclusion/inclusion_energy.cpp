#include "rt/inclusion/inclusion_energy.h"

#include <algorithm>
#include <cmath>

#include "rt/signal/vector.h"

namespace hapticd::rt {

namespace {

constexpr double kMinDistanceShare = 0.25;  // of l_0 to the sphere: nearer the laws mean nothing
constexpr double kTinyMm = 1e-6;
constexpr double kFadeShare = 0.2;  // of the displacement that the response was identified to
constexpr double kLastShare = 0.8;  // of l_0, up to which a response is believed

double l0_mm(const InclusionParameters& inclusion) noexcept {
  return norm(inclusion.place_mm - inclusion.surface_mm);
}

/// How much the pressed surface faces the sphere's nearest point: 1 up to 60° from l_0, 0 from 90° on. A tip
/// that presses from the side or from below has another surface in front of it.
double facing_of(const InclusionParameters& inclusion, const hal::Vector3& normal) noexcept {
  constexpr double kFullCosine = 0.5;
  const hal::Vector3 l0 = inclusion.surface_mm - inclusion.place_mm;
  const double u = std::clamp(dot(normal, l0) / (norm(l0) * kFullCosine), 0.0, 1.0);
  return u * u * (3.0 - 2.0 * u);
}

/// max(x, floor) with a round corner, and its slope.
struct Floored {
  double value;
  double slope;
};
Floored floored(double x, double floor) noexcept {
  const double over = x - floor;
  const double root = std::sqrt(over * over + 0.01 * floor * floor);
  return {floor + 0.5 * (over + root), 0.5 * (1.0 + over / root)};
}

}  // namespace

InclusionResponse response_at(const InclusionParameters& inclusion, double displacement_mm) noexcept {
  if (!(displacement_mm > 0.0)) return {};
  const HuntCrossleyParameters& law = inclusion.response;
  const double l0 = l0_mm(inclusion);
  const double end_mm = std::min(inclusion.max_displacement_mm, kLastShare * l0);
  const double x = std::min(displacement_mm, end_mm);
  const double power = std::pow(x, law.exponent);
  InclusionResponse r;
  r.elastic_n = law.stiffness_n_per_mm_m * power;
  r.energy_n_mm = r.elastic_n * x / (law.exponent + 1.0);
  r.damping_n_s_per_mm = law.damping_n_s_per_mm_m1 * power;
  if (displacement_mm <= end_mm) return r;
  // Beyond: the slope fades, no kink.
  const double fade_mm = kFadeShare * end_mm;
  const double slope = law.exponent * r.elastic_n / end_mm;
  const double beyond_mm = std::min(displacement_mm, l0) - end_mm;
  const double gained_mm = -std::expm1(-beyond_mm / fade_mm) * fade_mm;
  r.energy_n_mm += r.elastic_n * beyond_mm + slope * fade_mm * (beyond_mm - gained_mm);
  r.elastic_n += slope * gained_mm;
  if (displacement_mm <= l0) return r;
  // Past the sphere: nothing after another l_0.
  const double u = std::min(1.0, (displacement_mm - l0) / l0);
  r.energy_n_mm += r.elastic_n * l0 * (u - u * u * u + 0.5 * u * u * u * u);
  const double left = 1.0 - u * u * (3.0 - 2.0 * u);
  r.elastic_n *= left;
  r.damping_n_s_per_mm *= left;
  return r;
}

InclusionShare share_at(const InclusionParameters& inclusion, const Indentation& at) noexcept {
  const double l0 = l0_mm(inclusion);
  const double least = kMinDistanceShare * l0;
  const double n = inclusion.attenuation;
  const double approached = inclusion.approach * at.displacement_mm;
  const hal::Vector3 surface_mm = at.tip_mm + at.normal * at.displacement_mm;
  const hal::Vector3 from_sphere = surface_mm - inclusion.place_mm;
  const double depth = dot(from_sphere, at.normal);
  const hal::Vector3 offset = from_sphere - at.normal * depth;
  // p_ts is the nearest point of the surface: what seems nearer is an error of the estimated one.
  const Floored a = floored(std::max(depth, l0) - approached, least);
  const Floored a0 = floored(l0 - approached, least);
  const double squared = a.value * a.value + dot(offset, offset);

  InclusionShare share;
  share.value = facing_of(inclusion, at.normal) * std::pow(a0.value, n - 2.0) * a.value * a.value *
                std::pow(squared, -0.5 * n);
  share.by_displacement =
      -inclusion.approach * share.value *
      ((n - 2.0) * a0.slope / a0.value + a.slope * (2.0 / a.value - n * a.value / squared));
  share.by_place = offset * (-n * share.value / squared);
  return share;
}

hal::Vector3 energy_force_n(const InclusionParameters& inclusion, const Indentation& at) noexcept {
  if (!(at.displacement_mm > 0.0)) return {};
  const InclusionResponse response = response_at(inclusion, at.displacement_mm);
  const InclusionShare share = share_at(inclusion, at);
  const double along_n = (response.elastic_n + response.damping_n_s_per_mm * at.rate_mm_per_s) * share.value +
                         response.energy_n_mm * share.by_displacement;
  return at.normal * std::max(0.0, along_n) - share.by_place * response.energy_n_mm;
}

hal::Vector3 published_force_n(const InclusionParameters& inclusion, const Indentation& at) noexcept {
  const hal::Vector3 surface_mm = at.tip_mm + at.normal * at.displacement_mm;
  const hal::Vector3 line = inclusion.place_mm - surface_mm;
  const hal::Vector3 from_sphere = at.tip_mm - inclusion.place_mm;
  const double line_mm = norm(line);
  const double distance_mm = norm(from_sphere);
  if (!(line_mm > kTinyMm && distance_mm > kTinyMm)) return {};
  const hal::Vector3 u = line * (1.0 / line_mm);
  const double scale = -dot(at.normal, u) * l0_mm(inclusion) / line_mm;
  const double x = at.displacement_mm * scale;
  if (!(x > 0.0)) return {};
  const HuntCrossleyParameters& law = inclusion.response;
  const double power = std::pow(x, law.exponent);
  const double f = power * (law.stiffness_n_per_mm_m + law.damping_n_s_per_mm_m1 * at.rate_mm_per_s * scale);
  return from_sphere * (f / distance_mm);
}

hal::Vector3 movement_mm(const InclusionParameters& inclusion, const Indentation& at) noexcept {
  const hal::Vector3 towards = inclusion.place_mm - at.tip_mm;
  const double distance_mm = norm(towards);
  if (!(at.displacement_mm > 0.0 && distance_mm > kTinyMm)) return {};
  const double moved_mm = 0.5 * at.displacement_mm;
  if (inclusion.variant == InclusionVariant::kPublished) return towards * (moved_mm / distance_mm);
  // As much as the load reaches it, and away from the surface point: that does not turn round where the tip
  // goes past the sphere.
  const hal::Vector3 down = towards - at.normal * at.displacement_mm;
  const double share = share_at(inclusion, at).value;
  return down * (moved_mm * std::sqrt(2.0 * share / (1.0 + share)) / std::max(kTinyMm, norm(down)));
}

}  // namespace hapticd::rt
