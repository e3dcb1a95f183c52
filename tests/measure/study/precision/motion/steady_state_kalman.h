#pragma once

#include <array>
#include <cstddef>

namespace hapticd::study {

/// Kalman filter on positions with its gain at rest, for N = 2 (constant velocity, the α-β filter) or N = 3
/// (constant acceleration, α-β-γ): position, velocity and so on are carried on over the tick and corrected by
///   x⁺ = x⁻ + K (y - x⁻),
/// where K is the limit of the Riccati recursion for a highest derivative that jumps at each tick by a random
/// amount: x = F x + g w, g = (T²/2, T) or (T²/2, T, 1). N = 2 has Kalata's closed form (1984). A candidate
/// that hapticd does not ship.
template <std::size_t N>
class SteadyStateKalman {
  static_assert(N == 2 || N == 3);

 public:
  /// `position_deviation_mm`: of a reading; an encoder's step / √12. `jump`: standard deviation of w, in
  /// mm/s²: of the acceleration within a tick (N = 2), of its change from tick to tick (N = 3).
  SteadyStateKalman(double position_deviation_mm, double jump, double rate_hz) noexcept;

  /// One tick. The first position is taken as it is, at rest.
  void update(double position_mm) noexcept;

  double velocity_mm_per_s() const noexcept { return state_[1]; }
  double acceleration_mm_per_s2() const noexcept { return N == 3 ? state_[N - 1] : 0.0; }
  const std::array<double, N>& gain() const noexcept { return gain_; }

 private:
  double period_s_;
  bool started_ = false;
  std::array<double, N> gain_{};
  std::array<double, N> state_{};
};

extern template class SteadyStateKalman<2>;
extern template class SteadyStateKalman<3>;

}  // namespace hapticd::study
