#include "tests/measure/study/identify/friction_validation.h"

#include <cmath>
#include <stdexcept>
#include <utility>

#include "hal/sim/simulated_rig.h"
#include "rt/friction/dahl.h"
#include "rt/signal/motion_estimator.h"
#include "rt/signal/tool_load.h"
#include "tests/measure/study/common/plant.h"
#include "tests/measure/study/common/scenes.h"
#include "tests/support/value_of.h"

namespace hapticd::study {

using test::demand;
using test::value_of;

std::vector<FrictionInstant> validation_strokes(const std::string& object, const std::string& tip,
                                                double length_mm) {
  sim::SimulationConfig config = explore_rig("phantom_1_5_high_force", object, tip);
  config.seed = 97;
  const auto rig = value_of(create_rig(config));
  rt::ThreeAxisMotion motion(rig->info().device.position_resolution_mm, config.rate_hz);
  const rt::ToolLoad load(config.tool_mass_g, hal::Vector3{0.0, 0.0, -1.0});
  std::vector<FrictionInstant> strokes;
  hal::RigSample sample;
  hal::TruthSample truth;
  double now_s = 0.0;
  for (const auto& [force_n, speed] : {std::pair{2.0, 60.0}, {4.0, 90.0}, {2.5, 120.0}}) {
    sim::HandProgram hand;
    hand.kind = sim::HandProgram::Kind::kStroke;
    hand.force_n = force_n;
    hand.speed_mm_per_s = speed;
    hand.stroke_length_mm = length_mm;
    hand.repetitions = 2;
    hand.force_rate_n_per_s = 4.0;
    hand.approach_mm_per_s = 40.0;
    demand(rig->set_program(hand));
    const double until_s = now_s + sim::planned_duration_s(hand);
    bool stroking = false;
    hal::Vector3 last_mm;
    while (now_s < until_s) {
      rig->read(sample);
      rig->write({});
      rig->truth(truth);
      now_s = 1e-9 * static_cast<double>(sample.time_ns);
      motion.update(sample.tip_position_mm, sample.time_ns);
      const hal::Vector3 step_mm = sample.tip_position_mm - last_mm;
      last_mm = sample.tip_position_mm;
      // The way into the first stroke and out of the last does not belong to a stroke.
      if (std::abs(sample.tip_position_mm.x) > 0.4 * length_mm) stroking = true;
      if (!truth.in_contact || truth.normal_force_n < 0.2) stroking = false;
      if (!stroking) continue;
      const hal::Vector3 n = truth.outward_normal;
      const hal::Vector3 t = rt::direction_or(rt::across({1.0, 0.0, 0.0}, n), {1.0, 0.0, 0.0});
      const hal::Vector3 reaction_n =
          load.without_weight_n(sample) + load.inertia_n(motion.acceleration_mm_per_s2());
      FrictionInstant instant;
      instant.time_s = now_s;
      instant.along_mm = sample.tip_position_mm.x;
      instant.slide_mm = dot(step_mm, t);
      instant.speed_mm_per_s = dot(motion.velocity_mm_per_s(), t);
      instant.normal_n = dot(reaction_n, n);
      instant.measured_friction_n = -dot(reaction_n, t);
      instant.true_friction_n = -dot(truth.reaction_force_n, t);
      instant.true_normal = n;
      instant.tip_mm = sample.tip_position_mm;
      strokes.push_back(instant);
    }
  }
  return strokes;
}

FrictionJudgement judge_friction(const std::vector<FrictionInstant>& strokes,
                                 const rt::FrictionParameters& parameters) {
  FrictionJudgement judgement;
  double z = 0.0;
  rt::MaxwellSlip elements(parameters.maxwell_slip.value_or(rt::MaxwellSlipParameters{}));
  constexpr double kMovesMmPerS = 2.0;
  constexpr double kSlidesMmPerS = 10.0;
  double moving = 0.0;
  double left_all = 0.0, whole_all = 0.0;
  double left = 0.0, whole = 0.0, left_sliding = 0.0, whole_sliding = 0.0;
  double path_mm = 0.0, heading = 0.0, farthest_mm = 0.0;
  double last_s = -1.0;
  for (const FrictionInstant& s : strokes) {
    if (s.time_s - last_s > 0.01) {  // another stroke begins
      z = 0.0;
      elements.release();
      path_mm = 0.0;
      heading = 0.0;
      farthest_mm = s.along_mm;
    } else if (parameters.maxwell_slip) {
      z = elements.step(s.slide_mm) / parameters.kinetic;
    } else {
      z = rt::dahl_step(z, s.slide_mm, parameters.presliding_mm, parameters.exponent);
    }
    last_s = s.time_s;
    const double ahead_mm = (s.along_mm - farthest_mm) * (heading == 0.0 ? 1.0 : heading);
    if (heading == 0.0 ? std::abs(ahead_mm) > 0.1 : ahead_mm < -0.1) {
      heading = s.along_mm > farthest_mm ? 1.0 : -1.0;
      path_mm = 0.0;
      farthest_mm = s.along_mm;
    } else if (ahead_mm > 0.0) {
      path_mm += ahead_mm;
      farthest_mm = s.along_mm;
    }
    const double predicted =
        parameters.kinetic * s.normal_n * z + parameters.viscous_n_s_per_mm * s.speed_mm_per_s;
    judgement.predicted_n.push_back(predicted);
    left_all += std::abs(predicted - s.true_friction_n);
    whole_all += std::abs(s.true_friction_n);
    const double speed = std::abs(s.speed_mm_per_s);
    if (speed < kMovesMmPerS) continue;
    left += std::abs(predicted - s.true_friction_n);
    whole += std::abs(s.true_friction_n);
    moving += 1.0;
    if (path_mm < 3.0 || speed < kSlidesMmPerS) continue;
    left_sliding += std::abs(predicted - s.true_friction_n);
    whole_sliding += std::abs(s.true_friction_n);
  }
  if (!(whole_sliding > 0.0)) throw std::runtime_error("no stroke touched the object");
  judgement.error = left / whole;
  judgement.sliding_error = left_sliding / whole_sliding;
  judgement.error_at_rest_too = left_all / whole_all;
  const double min_n = 0.2 * whole / moving;
  double ratios = 0.0;
  double count = 0.0;
  for (std::size_t i = 0; i < strokes.size(); ++i) {
    const double truth = std::abs(strokes[i].true_friction_n);
    if (truth < min_n || std::abs(strokes[i].speed_mm_per_s) < kMovesMmPerS) continue;
    ratios += std::abs(judgement.predicted_n[i] - strokes[i].true_friction_n) / truth;
    count += 1.0;
  }
  judgement.mean_of_ratios = count > 0.0 ? ratios / count : 0.0;
  return judgement;
}

}  // namespace hapticd::study
