#include "rt/target/feasible_range.h"

#include <cmath>
#include <limits>

namespace hapticd::rt {

namespace {
constexpr double kUnbounded = std::numeric_limits<double>::infinity();
}

FeasibleRange feasible_range(double object_stiffness_n_per_mm, double hand_force_n,
                             const DeviceReach& device) noexcept {
  if (!(hand_force_n > 0.0)) return {0.0, kUnbounded};
  const double scale = object_stiffness_n_per_mm * hand_force_n;
  return {scale / (hand_force_n + device.pull_n),
          hand_force_n > device.push_n ? scale / (hand_force_n - device.push_n) : kUnbounded};
}

FeasibleRange feasible_range(double object_stiffness_n_per_mm, double hand_force_n,
                             double max_device_force_n) noexcept {
  return feasible_range(object_stiffness_n_per_mm, hand_force_n, {max_device_force_n, max_device_force_n});
}

std::optional<FeasibleRange> feasible_range(const ObjectModel& model, double hand_force_n,
                                            const DeviceReach& device) {
  if (!model.creep && !model.hunt_crossley) return std::nullopt;
  if (!(hand_force_n > 0.0)) return FeasibleRange{0.0, kUnbounded};
  // Each end by (3.8) with the secant stiffness at the force that the object pushes back with there.
  const auto secant_n_per_mm = [&model](double force_n) { return *stiffness_n_per_mm(model, force_n); };
  FeasibleRange range{0.0, kUnbounded};
  range.min_n_per_mm =
      feasible_range(secant_n_per_mm(hand_force_n + device.pull_n), hand_force_n, device).min_n_per_mm;
  if (hand_force_n > device.push_n) {
    range.max_n_per_mm =
        feasible_range(secant_n_per_mm(hand_force_n - device.push_n), hand_force_n, device).max_n_per_mm;
  }
  if (!std::isfinite(range.min_n_per_mm) || std::isnan(range.max_n_per_mm)) return std::nullopt;
  return range;
}

}  // namespace hapticd::rt
