#pragma once

#include <string>
#include <vector>

#include "hal/sim/hand/hand.h"
#include "hal/sim/simulated_rig.h"
#include "rt/model/models.h"
#include "rt/scene/scene_spec.h"

namespace hapticd::study {

/// A hand presses and holds; what it feels is read off the truth.
struct PressTask {
  sim::SimulationConfig rig{};
  rt::SceneSpec scene{};
  const rt::ObjectModel* model = nullptr;  ///< of the object, if the scene needs one
  sim::HandProgram hand{};
  double judged_from_s = 2.0;  ///< after the force has been built up
  double judged_to_s = 3.0;

  /// How long the hand takes to build its force up.
  double load_s() const { return 1.875 * hand.force_n / hand.force_rate_n_per_s; }
};

/// One instant of the press.
struct PressPoint {
  double since_s = 0.0;  ///< after the contact began
  double depth_mm = 0.0;
  double hand_force_n = 0.0;
};

struct PressOutcome {
  std::string failed;              ///< why there is no figure; empty = there is
  double rendered_n_per_mm = 0.0;  ///< mean force over mean depth of the time that is judged
  std::vector<PressPoint> points;
};

/// A press to `force_n` in the scene `tap_1d`, held for three seconds; the last of them is judged.
PressTask tap_press(const std::string& device, const std::string& object, double target, bool compensated,
                    double force_n);

/// Presses on the simulated rig in virtual time.
PressOutcome press_direct(const PressTask& task);

}  // namespace hapticd::study
