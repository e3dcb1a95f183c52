#pragma once

#include <optional>
#include <string>
#include <vector>

#include "hal/sim/simulated_rig.h"
#include "rt/model/models.h"
#include "rt/scene/scene_spec.h"
#include "tests/measure/study/stability/stability_class.h"

namespace hapticd::study {

/// A contact as it is tried: all but the target.
struct StabilityTrial {
  sim::SimulationConfig rig{};
  rt::SceneSpec scene{};
  std::optional<rt::ObjectModel> model{};  ///< of the object, if the scene needs one
  bool weight = false;                     ///< the passive 408 g of D§3.3.2 instead of a hand

  double grip_stiffness_scale = 1.0;
  double grip_damping_scale = 1.0;
  double knock_n = 1.0;
  double press_n = 4.0;

  const sim::ObjectModel& object() const { return *rig.custom_object; }
  double object_n_per_mm() const { return object().material.stiffness_at_4n_n_per_mm; }
  const sim::DeviceModel& device() const { return *rig.custom_device; }
};

inline constexpr double kPressN = 4.0;
/// Trial in one line, for the remarks.
inline constexpr const char* kTrialInWords =
    "Trial: the target is set and a hand presses 4 N within a second (or 408 g are let down on "
    "the object's own stiffness, at most a fifth of the structure's, and the target is raised from there), "
    "is knocked with 1 N for 20 ms a second after, "
    "and what follows for 1.85 s is classed from the truth.";

/// `tap_1d` as it is shipped, on this device and object, at this rate; the targets it grants end at
/// granted_n_per_mm().
StabilityTrial tap_trial(const std::string& device, const sim::ObjectModel& object, double rate_hz = 1000.0);
/// `explore_bearing` as it is shipped, its fused estimator knowing the model.
StabilityTrial explore_trial(const std::string& device, const sim::ObjectModel& object,
                             const rt::ObjectModel& model, double rate_hz = 1000.0);

/// The stiffest target that a client is granted in this scene: the device's largest, and no more than can be
/// compensated of its structure.
double granted_n_per_mm(const StabilityTrial& trial);
/// 0.8 of the structural stiffness, if the target is solved for the device's force; infinite elsewhere.
double compensable_n_per_mm(const StabilityTrial& trial);
/// The softest target that (3.8) would leave feasible under 4 N if the device gave all that the sensor, which
/// feels hand and device together, can measure: softer than what it gives (rt/target/device_reach.h), so that
/// what is tried goes beyond what is reached.
double softest_feasible_n_per_mm(const StabilityTrial& trial);

struct TrialOutcome {
  StabilityClass verdict = StabilityClass::kStable;
  double swing_mm = 0.0;
  double swing_n = 0.0;
  double peak_n = 0.0;        ///< of the object's force
  bool at_full_pull = false;  ///< at the end: softer was asked for than device or sensor bear
};
TrialOutcome run_trial(const StabilityTrial& trial, double target_n_per_mm);

/// The contiguous range of stable targets.
struct StableRange {
  double max_n_per_mm = 0.0;  ///< 0: none was found
  double min_n_per_mm = 0.0;
  bool max_found = false;  ///< unstable beyond; else stable up to the end of the search
  bool min_found = false;  ///< unstable below; else stable down to the softest feasible target
  StabilityClass beyond = StabilityClass::kStable;
  StabilityClass below = StabilityClass::kStable;
  StabilityClass at_start = StabilityClass::kStable;

  bool any() const { return max_n_per_mm > 0.0; }
  /// Distance of a target from the nearer end of the range, as a factor: 1.5 = half as much again is still
  /// stable; below 1 it is unstable itself. 0 if nothing is stable.
  double margin(double target_n_per_mm) const;
};

/// Starts at `start`, raises the target by half until it is unstable or beyond `end`, lowers it likewise to
/// `floor`, and closes in on the ends to `octaves`
/// (1/16: 4.5 %). If the start is unstable, looks below, then above it, for a target that is not.
StableRange find_stable_range(const StabilityTrial& trial, double floor, double start, double end,
                              double octaves = 1.0 / 16.0);

/// Converts to and from the values of a cell.
std::vector<double> values_of(const StableRange& range);
StableRange range_of(const std::vector<double>& values);

}  // namespace hapticd::study
