#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <type_traits>

#include "hal/error.h"
#include "hal/samples.h"
#include "rt/deformation/hunt_crossley.h"

namespace hapticd::rt {

/// Damping that a target may have if the loop runs at 1 kHz or faster.
inline constexpr double kMaxTargetDampingNsPerMm = 0.005;

/// Maximum damping at the loop's rate. Behind a delay τ a damper b on a free mass m is stable for b τ/m <
/// π/2; the lightest device has 0.075 kg, and reading, loop, controller and motors take 3.7 ms at 1 kHz: 0.03
/// N·s/mm. A sixth of that is also passive with the velocity's own lag of some periods. Slower loops have
/// less, in proportion.
constexpr double max_target_damping_n_s_per_mm(double rate_hz) noexcept {
  return rate_hz < 1000.0 ? kMaxTargetDampingNsPerMm * rate_hz / 1000.0 : kMaxTargetDampingNsPerMm;
}

/// What the object is to feel like: the force at the hand for a displacement.
struct TargetLaw {
  enum class Kind : std::uint8_t {
    kLinear,               ///< F = k~ x   (4.3)
    kHuntCrossley,         ///< F = K x^m + B x^m ẋ   (4.22)
    kDisplacementProfile,  ///< F = ∫ k~(x) dx: the stiffness felt at each depth
    kPositionProfile,      ///< F = k~(s) x, s the tip's coordinate along an axis of the rig
  };
  struct Knot {
    double at_mm = 0.0;
    double stiffness_n_per_mm = 0.0;
  };
  static constexpr std::size_t kMaxKnots = 16;

  Kind kind = Kind::kLinear;
  double stiffness_n_per_mm = 0.5;
  HuntCrossleyParameters hunt_crossley;
  /// Profiles: straight lines between knots, constant beyond the first and the last; at_mm must rise.
  std::array<Knot, kMaxKnots> knots{};
  std::uint32_t knot_count = 0;
  hal::Vector3 axis{1.0, 0.0, 0.0};  ///< kPositionProfile; unit vector

  /// Force at the hand, ≥ 0, for a displacement ≥ 0 that changes at `rate_mm_per_s`, the tip being at
  /// `tip_mm`. The law's damping dF/dẋ is held to `max_damping_n_s_per_mm`.
  double force_n(double displacement_mm, double rate_mm_per_s, const hal::Vector3& tip_mm,
                 double max_damping_n_s_per_mm = kMaxTargetDampingNsPerMm) const noexcept;
};
static_assert(std::is_trivially_copyable_v<TargetLaw>);

constexpr TargetLaw linear_target(double stiffness_n_per_mm) noexcept {
  TargetLaw law;
  law.stiffness_n_per_mm = stiffness_n_per_mm;
  return law;
}

/// Largest stiffness that the law asks for up to `max_displacement_mm`: limits and stability are judged by
/// it.
double greatest_stiffness_n_per_mm(const TargetLaw& law, double max_displacement_mm) noexcept;

/// Largest damping dF/dẋ of the law at a displacement, as it is rendered; 0 of laws that have none.
double damping_n_s_per_mm(const TargetLaw& law, double displacement_mm) noexcept;

/// Normalises the axis; an error names what is out of range: stiffness 0 … 1000 N/mm, exponent 1 … 3, 1 … 16
/// knots that rise, damping at a displacement of 1 mm within kMaxTargetDampingNsPerMm.
std::optional<hal::Error> check(TargetLaw& law, const std::string& where);

}  // namespace hapticd::rt
