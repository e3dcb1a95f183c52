#pragma once

#include <optional>
#include <string>
#include <vector>

#include "hal/sim/simulated_rig.h"
#include "rt/model/models.h"
#include "rt/scene/scene_spec.h"

namespace hapticd::study {

/// What a press is made with; all of it may be changed before it is tried.
struct LoadingTrial {
  sim::SimulationConfig rig{};
  rt::SceneSpec scene{};
  std::optional<rt::ObjectModel> model{};  ///< of the object, if the scene needs one
  double target_n_per_mm = 0.0;
  double force_n = 2.0;               ///< of the hand, when the target is rendered exactly
  double rate_n_per_s = 10.0;         ///< largest rate at which that force builds up
  double grip_stiffness_scale = 1.0;  ///< of the hand's own spring, see HandProgram

  /// The hand's intended motion is minimum-jerk: its mean rate is rate_n_per_s / 1.875.
  double load_s() const { return 1.875 * force_n / rate_n_per_s; }
};

/// `tap_1d` (dims 1) or `explore_bearing` (dims 3) on a simulated device and object, at a target. Exploring
/// needs the object's model.
LoadingTrial tap_loading(const std::string& device, const std::string& object, double target_n_per_mm);
LoadingTrial explore_loading(const std::string& device, const std::string& object, double target_n_per_mm,
                             const rt::ObjectModel& model);

/// One instant of the press, from the truth.
struct LoadingPoint {
  double since_s = 0.0;  ///< after the hand began to press
  double displacement_mm = 0.0;
  double hand_force_n = 0.0;  ///< along the surface normal
  double error = 0.0;         ///< hand force over target stiffness × displacement, less 1
};

struct LoadingOutcome {
  std::string failed;         ///< why there is no figure; empty = there is
  double error_mean = 0.0;    ///< mean |error| while loading
  double error_signed = 0.0;  ///< mean error then
  double error_held = 0.0;  ///< mean force over target × mean displacement, less 1, in the hold's last second
  double max_rate_n_per_s = 0.0;      ///< of the hand's force, over 20 ms
  std::vector<LoadingPoint> loading;  ///< what error_mean is the mean of, a tick each
};

/// Loading is judged beyond this share of the final displacement, until the hand means to hold.
inline constexpr double kJudgedBeyondShare = 0.1;

/// A hand that goes to a height along a minimum-jerk course and stays there. `grip_stiffness_scale`: see
/// HandProgram.
sim::HandProgram going_to(double height_mm, double travel_s, double grip_stiffness_scale = 1.0);

/// The hand waits just above the surface, presses along a minimum-jerk course to where the target at
/// `force_n` would let it rest, and holds for three seconds. Its own spring lies between what it means and
/// what it does. Force and displacement are the simulation's truth.
LoadingOutcome press(const LoadingTrial& trial);

}  // namespace hapticd::study
