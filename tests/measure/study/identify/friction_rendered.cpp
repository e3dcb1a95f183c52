#include "tests/measure/study/identify/friction_rendered.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <vector>

#include "rt/deformation/tracked_direction.h"
#include "rt/signal/motion_estimator.h"
#include "rt/signal/tool_load.h"
#include "tests/measure/study/common/plant.h"
#include "tests/measure/study/common/scenes.h"
#include "tests/support/value_of.h"

namespace hapticd::study {

RenderedFriction rendered_friction(const std::string& object, const rt::FrictionParameters& friction) {
  constexpr double kForceN = 4.0;
  constexpr double kSpeedMmPerS = 90.0;
  constexpr double kTouchedN = 0.2;
  constexpr double kJudgedN = 0.5;
  constexpr int kOnsetTicks = 200;
  sim::SimulationConfig config = explore_rig("phantom_1_5_high_force", object, "rod");
  config.seed = 31;
  const auto rig = test::value_of(create_rig(config));
  const hal::RigInfo& info = rig->info();
  const sim::HandProgram hand = judged_strokes(kForceN, kSpeedMmPerS);
  test::demand(rig->set_program(hand));
  const double end_s = judged_strokes_end_s(hand);
  const rt::ToolLoad load(info.sensor.tool_mass_g, hal::Vector3{0.0, 0.0, -1.0});
  rt::ThreeAxisMotion motion(info.device.position_resolution_mm, info.rate_hz);
  rt::TrackedDirection direction(friction, rt::ExploreParameters{}.force_noise_n, info.rate_hz);

  std::vector<double> angles_rad;
  double left_n = 0.0, whole_n = 0.0, angle_sum_rad = 0.0;
  bool touches = false;
  int touching_ticks = 0;
  hal::Vector3 last_mm;
  hal::RigSample sample;
  hal::TruthSample truth;
  for (;;) {
    rig->read(sample);
    rig->write({});
    rig->truth(truth);
    if (1e-9 * static_cast<double>(sample.time_ns) > end_s) break;
    motion.update(sample.tip_position_mm, sample.time_ns);
    const hal::Vector3 reaction_n =
        load.without_weight_n(sample) + load.inertia_n(motion.acceleration_mm_per_s2());
    const double true_n = rt::norm(truth.reaction_force_n);
    const bool touched = touches;
    touches = true_n > kTouchedN;
    if (touches && !touched) {
      direction.begin(reaction_n);
      touching_ticks = 0;
    } else if (touches) {
      direction.update(reaction_n, sample.tip_position_mm - last_mm, motion.velocity_mm_per_s());
    }
    last_mm = sample.tip_position_mm;
    if (!touches || ++touching_ticks < kOnsetTicks || true_n < kJudgedN) continue;
    const hal::Vector3& normal = truth.outward_normal;
    const hal::Vector3 friction_n = rt::across(truth.reaction_force_n, normal);
    left_n += rt::norm(direction.friction_n() - friction_n);
    whole_n += rt::norm(friction_n);
    angles_rad.push_back(
        std::atan2(rt::norm(rt::cross(normal, direction.normal())), dot(normal, direction.normal())));
    angle_sum_rad += angles_rad.back();
  }
  if (angles_rad.empty()) throw std::runtime_error("no stroke touched the object");
  const auto p95 = angles_rad.begin() + static_cast<std::ptrdiff_t>(angles_rad.size() * 95 / 100);
  std::nth_element(angles_rad.begin(), p95, angles_rad.end());
  return {left_n / whole_n, angle_sum_rad / static_cast<double>(angles_rad.size()), *p95};
}

}  // namespace hapticd::study
