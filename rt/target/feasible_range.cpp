#include "rt/target/feasible_range.h"

#include <limits>

namespace hapticd::rt {

FeasibleRange feasible_range(double object_stiffness_n_per_mm, double hand_force_n,
                             double max_device_force_n) noexcept {
  constexpr double kUnbounded = std::numeric_limits<double>::infinity();
  if (!(hand_force_n > 0.0)) return {0.0, kUnbounded};
  const double scale = object_stiffness_n_per_mm * hand_force_n;
  return {scale / (hand_force_n + max_device_force_n),
          hand_force_n > max_device_force_n ? scale / (hand_force_n - max_device_force_n) : kUnbounded};
}

}  // namespace hapticd::rt
