#pragma once

#include <optional>

#include "rt/model/models.h"
#include "rt/target/device_reach.h"

namespace hapticd::rt {

/// Stiffness range of (3.8).
struct FeasibleRange {
  double min_n_per_mm = 0.0;
  double max_n_per_mm = 0.0;  ///< infinite if the device alone can hold the hand
};

/// k f_h / (f_h + f_pull) ≤ k~ ≤ k f_h / (f_h - f_push): (3.8) where the device's force is not the same both
/// ways. k is the secant stiffness of the object, the same at every depth: of one that densifies the softest
/// is more than this says, for the softer it is to feel the deeper it is pressed. A hand that does not press
/// (f_h ≤ 0, NaN) leaves everything feasible.
FeasibleRange feasible_range(double object_stiffness_n_per_mm, double hand_force_n,
                             const DeviceReach& device) noexcept;

/// Feasible range by (3.8) as published, for a device that gives ±max_device_force_n.
FeasibleRange feasible_range(double object_stiffness_n_per_mm, double hand_force_n,
                             double max_device_force_n) noexcept;

/// Feasible range on an object whose law x(f) is known, however bent it is: a hand that feels k~ has the tip
/// at x = f_h/k~, where the object pushes back with f_h + f_d, so
///
///   f_h / x(f_h + f_pull) ≤ k~ ≤ f_h / x(f_h - f_push).
///
/// An exponent of 1 gives (3.8). x is the settled law: by the creep law, else by Hunt-Crossley's
/// without damping (exponent m: the softest is f_h (K/(f_h + f_pull))^(1/m)); an object that has not crept
/// yet is stiffer. Beyond the force it was identified with the law is extrapolated, the creep law as a
/// straight line, which takes an object that goes on densifying for softer than it is. None if the model has
/// no law or its law is unfit (see check(const ObjectModel&)).
std::optional<FeasibleRange> feasible_range(const ObjectModel& model, double hand_force_n,
                                            const DeviceReach& device);

}  // namespace hapticd::rt
