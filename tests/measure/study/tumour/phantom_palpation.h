#pragma once

#include <vector>

#include "hal/sim/object/object_model.h"
#include "rt/model/models.h"
#include "rt/scene/scene_spec.h"
#include "server/identification/estimate/inclusion/inclusion_fit.h"
#include "tests/measure/study/common/virtual_run.h"

namespace hapticd::study {

/// One vertical press of a phantom, the tip held over its place by a stiff grip (D§5.4).
struct PhantomPress {
  double x_mm = 0.0, y_mm = 0.0;
  double depth_mm = 12.0;
  double speed_mm_per_s = 40.0;  ///< the largest, while loading
};

/// Height of the tip where it meets the surface at (x, y).
double phantom_height_mm(double x_mm, double y_mm);

/// The device of D§5.2 with a phantom under it.
sim::SimulationConfig phantom_rig(const sim::ObjectModel& phantom);
sim::ObjectModel phantom_object(const char* name);
/// A phantom with one inclusion anywhere: axis tilted so that it lies below the surface point at (x, y).
sim::ObjectModel phantom_with_inclusion_at(double x_mm, double y_mm, double depth_mm,
                                           double stiffness_at_10mm_n_per_mm);

/// Presses once; `each` is called after every tick.
template <class Each>
void press_phantom(VirtualRun& run, const PhantomPress& press, Each&& each) {
  sim::HandProgram hand;
  hand.kind = sim::HandProgram::Kind::kPress;
  hand.place_mm = {press.x_mm, press.y_mm, phantom_height_mm(press.x_mm, press.y_mm)};
  hand.depth_mm = press.depth_mm;
  hand.approach_mm_per_s = press.speed_mm_per_s;
  hand.hold_s = 0.2;
  hand.travel_s = 0.5;
  hand.grip_stiffness_scale = 8.0;
  hand.grip_damping_scale = 3.0;
  run.set_hand(hand);
  const double until_s = run.time_s() + 2.6 + 3.0 * press.depth_mm / press.speed_mm_per_s;
  while (run.time_s() < until_s) {
    run.step();
    each();
  }
}

/// What encoders and sensor say of presses of a phantom, nothing rendered; the tool's weight and inertia
/// taken off.
std::vector<identification::Press> palpate_phantom(const sim::ObjectModel& phantom,
                                                   const std::vector<PhantomPress>& all);

/// Contact law of the phantom without a tumour, for scenes; identified once a run.
const rt::ObjectModel& phantom_model();

}  // namespace hapticd::study
