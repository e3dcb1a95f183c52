#pragma once

#include <array>
#include <cstddef>

#include "rt/deformation/contact_law.h"
#include "rt/signal/decay.h"

namespace hapticd::rt {

/// A contact law for objects that densify, creep and recover slowly, for which (4.22) fails (D§4.5.3,
/// D§4.7.3):
///
///   x = Ψ(e),  e = w_0 f + Σ w_i L_i f,  w ≥ 0, Σ w = 1,
///
/// L_i first-order lags of fixed retardation times. Ψ is any increasing curve. At constant force the object
/// yields w_0 at once and the rest as it creeps; without force, what is left of e shows how far the surface
/// has still to recover.
///
/// Written from force to displacement, so that there is nothing to invert: e is a weighted mean of present
/// and past forces, never beyond their extremes whatever they do, and Ψ is read off in constant time.
struct CreepParameters {
  static constexpr std::size_t kLags = 4;
  static constexpr std::size_t kKnots = 17;
  std::array<double, kLags> time_s{0.01, 0.1, 1.0, 5.0};
  std::array<double, kLags + 1> weight{1.0, 0.0, 0.0, 0.0, 0.0};  ///< w_0, w_1 …; normalised to sum 1
  /// Ψ at e = max_force_n · (j/16)²: dense where a soft object's curve bends. First 0, then increasing.
  std::array<double, kKnots> displacement_mm{};
  double max_force_n = 1.0;
};

/// The law and its memory. The lags are advanced exactly for a force held over the tick. Between the knots Ψ
/// is the monotone cubic of Fritsch and Carlson, beyond the last a straight line.
class CreepLaw {
 public:
  CreepLaw(const CreepParameters& parameters, double rate_hz) noexcept;

  /// Advances by `periods` of the loop under this normal force (negative counts as none).
  LawEstimate update(double normal_force_n, double periods = 1.0) noexcept;
  /// Forgets all past forces.
  void reset() noexcept { lagged_n_ = {}; }
  /// Ψ and its slope.
  LawEstimate curve(double effective_force_n) const noexcept;

 private:
  /// Takes note of the interval between two updates.
  void set_interval(double periods) noexcept;

  static constexpr std::size_t kLast = CreepParameters::kKnots - 1;

  double max_force_n_;
  std::array<double, CreepParameters::kLags + 1> weight_{};
  std::array<Decay, CreepParameters::kLags> decay_{};
  double periods_ = 0.0;                               ///< of the last interval, like the two below
  std::array<double, CreepParameters::kLags> kept_{};  ///< by each lag
  double immediate_ = 1.0;                             ///< how much of a newton counts in the tick it comes
  std::array<double, CreepParameters::kLags> lagged_n_{};
  std::array<double, CreepParameters::kKnots> knot_n_{};
  std::array<double, CreepParameters::kKnots> knot_mm_{};
  std::array<double, CreepParameters::kKnots> slope_mm_per_n_{};
};

}  // namespace hapticd::rt
