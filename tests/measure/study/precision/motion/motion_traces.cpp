#include "tests/measure/study/precision/motion/motion_traces.h"

#include <cmath>

#include "hal/sim/simulated_rig.h"
#include "tests/measure/study/common/hands.h"
#include "tests/measure/study/common/plant.h"
#include "tests/support/value_of.h"

namespace hapticd::study {

namespace {

using test::demand;
using test::value_of;

/// The physics takes ten steps a millisecond whatever the loop does; ticking with it shows each of them.
constexpr double kPhysicsHz = MotionTrace::kStepsPerTick * MotionTrace::kRateHz;
constexpr double kSettleS = 1.5;

sim::HandProgram stroking(double speed_mm_per_s) {
  sim::HandProgram hand;
  hand.kind = sim::HandProgram::Kind::kStroke;
  hand.force_n = 2.0;
  hand.speed_mm_per_s = speed_mm_per_s;
  hand.stroke_length_mm = 50.0;
  hand.repetitions = -1;
  hand.force_rate_n_per_s = 6.0;
  hand.approach_mm_per_s = 40.0;
  return hand;
}

MotionTrace trace(const std::string& name, const std::string& object, const sim::HandProgram& hand,
                  double hal::Vector3::*axis, double seconds) {
  sim::SimulationConfig config;
  config.object = object;
  config.rate_hz = kPhysicsHz;
  config.seed = 11;
  const auto rig = value_of(create_rig(config));
  demand(rig->set_program(hand));

  const auto steps_of = [](double s) { return static_cast<std::size_t>(std::lround(s * kPhysicsHz)); };
  const std::size_t settle = steps_of(kSettleS);
  std::vector<double> position_mm;
  hal::RigSample sample;
  hal::TruthSample truth;
  for (std::size_t i = 0; i < settle + steps_of(seconds) + 2; ++i) {
    rig->read(sample);
    rig->write({});
    rig->truth(truth);
    if (i >= settle) position_mm.push_back(truth.tip_position_mm.*axis);
  }
  MotionTrace result{name, {}, {}, {}};
  for (std::size_t i = 1; i + 1 < position_mm.size(); ++i) {
    const double before = position_mm[i - 1];
    const double here = position_mm[i];
    const double after = position_mm[i + 1];
    result.position_mm.push_back(here);
    result.velocity_mm_per_s.push_back(0.5 * kPhysicsHz * (after - before));
    result.acceleration_mm_per_s2.push_back(kPhysicsHz * kPhysicsHz * (after - 2.0 * here + before));
  }
  return result;
}

}  // namespace

std::vector<double> MotionTrace::encoder_mm(double step_mm) const {
  std::vector<double> reading;
  for (std::size_t k = 0; k < ticks(); ++k) {
    reading.push_back(std::round(position_mm[k * kStepsPerTick] / step_mm) * step_mm);
  }
  return reading;
}

std::vector<MotionTrace> motion_traces(double seconds, Vigour vigour) {
  struct Motions {
    double tap_mm_per_s, stroke_mm_per_s, wave_mm_per_s, wave_hz, shake_n, shake_hz;
  };
  const Motions m = vigour == Vigour::kUsual    ? Motions{400.0, 150.0, 30.0, 0.7, 1.0, 5.0}
                    : vigour == Vigour::kGentle ? Motions{100.0, 40.0, 10.0, 0.4, 0.3, 3.0}
                                                : Motions{1000.0, 300.0, 200.0, 2.0, 3.0, 8.0};
  sim::HandProgram waving;
  waving.kind = sim::HandProgram::Kind::kSway;
  waving.speed_mm_per_s = m.wave_mm_per_s;
  waving.rate_hz = m.wave_hz;
  waving.hold_s = -1.0;
  sim::HandProgram shaking = shaken();
  shaking.force_n = m.shake_n;
  shaking.rate_hz = m.shake_hz;
  sim::HandProgram still;
  still.kind = sim::HandProgram::Kind::kRest;
  return {trace("taps", "foam_ball", tapping(m.tap_mm_per_s), &hal::Vector3::z, seconds),
          trace("strokes", "sponge_block", stroking(m.stroke_mm_per_s), &hal::Vector3::x, seconds),
          trace("waving", "none", waving, &hal::Vector3::z, seconds),
          trace("shaking", "none", shaking, &hal::Vector3::z, seconds),
          trace("at rest", "none", still, &hal::Vector3::z, seconds)};
}

}  // namespace hapticd::study
