#pragma once

namespace hapticd::rt {

/// Stiffness range of (3.8).
struct FeasibleRange {
  double min_n_per_mm = 0.0;
  double max_n_per_mm = 0.0;  ///< infinite where the device alone can hold the hand
};

/// k f_h / (f_h + f_max) ≤ k~ ≤ k f_h / (f_h - f_max) for a device that gives ±max_device_force_n. A hand
/// that does not press (f_h ≤ 0) leaves everything feasible.
FeasibleRange feasible_range(double object_stiffness_n_per_mm, double hand_force_n,
                             double max_device_force_n) noexcept;

}  // namespace hapticd::rt
