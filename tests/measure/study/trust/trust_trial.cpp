#include "tests/measure/study/trust/trust_trial.h"

#include <algorithm>
#include <cmath>

#include "rt/scene/compose.h"
#include "rt/scene/renderer.h"
#include "tests/measure/study/common/plant.h"
#include "tests/measure/study/common/scenes.h"
#include "tests/support/free_air_judge.h"
#include "tests/support/value_of.h"

namespace hapticd::study {

namespace {

using Kind = sim::HandProgram::Kind;
using test::demand;
using test::value_of;

/// Height at which nothing is near: the waves' amplitude is 26 mm at most.
constexpr double kAirMm = 70.0;
constexpr double kMotionS = 8.0;

/// A program and when it takes over.
struct Act {
  double from_s = 0.0;
  sim::HandProgram program;
};

sim::HandProgram resting() {
  sim::HandProgram hand;
  hand.place_mm = {0.0, 0.0, kAirMm};
  return hand;
}

/// ±20 mm at 2.2 Hz and close to it, all axes at once.
sim::HandProgram waving() {
  sim::HandProgram hand = resting();
  hand.kind = Kind::kSway;
  hand.rate_hz = 2.2;
  hand.speed_mm_per_s = 276.0;
  hand.hold_s = kMotionS - 3.0;  // it dies down before the next
  return hand;
}

/// A motion with which the tool, on the spring of the hand, moves with 400 mm/s and 20 m/s².
sim::HandProgram darting(std::uint64_t seed) {
  sim::HandProgram hand = resting();
  hand.kind = Kind::kDart;
  hand.speed_mm_per_s = 330.0;
  hand.acceleration_m_per_s2 = 16.5;
  hand.rate_hz = 1.3;
  hand.stroke_length_mm = 50.0;
  hand.hold_s = kMotionS - 2.0;
  hand.grip_stiffness_scale = 2.0;
  hand.grip_damping_scale = 4.0;
  if (seed % 2 == 1) {
    hand.shake_direction = {0.6, 0.0, -0.8};
    hand.stroke_length_mm = 40.0;
  }
  return hand;
}

std::vector<Act> acts_of(const TrustCase& trial, double& duration_s) {
  std::vector<Act> acts;
  duration_s = std::max(trial.duration_s, trial.cause->duration_s);
  switch (trial.cause->motion) {
    case TrustMotion::kWaved:
    case TrustMotion::kAbrupt:
    case TrustMotion::kBoth: {
      acts.push_back({0.0, resting()});
      // Again and again, so that what comes rarely meets every motion.
      bool waves = trial.cause->motion != TrustMotion::kAbrupt;
      for (double at_s = 3.0; at_s < duration_s; at_s += kMotionS + 2.0) {
        acts.push_back({at_s, waves ? waving() : darting(trial.seed)});
        acts.push_back({at_s + kMotionS, resting()});
        if (trial.cause->motion == TrustMotion::kBoth) waves = !waves;
      }
      break;
    }
    case TrustMotion::kPress: {
      sim::HandProgram press;
      press.kind = Kind::kPress;
      press.force_n = trial.seed % 2 == 0 ? 2.0 : 4.0;
      press.force_rate_n_per_s = 4.0;
      press.approach_mm_per_s = 40.0;
      press.hold_s = -1.0;
      acts = {{0.0, press}, {8.5, waving()}};
      break;
    }
    case TrustMotion::kPressOften: {
      sim::HandProgram press;
      press.kind = Kind::kPress;
      press.force_n = std::max(trial.seed % 2 == 0 ? 2.0 : 1.0, 1.1 * trial.cause->biased_at_n);
      press.force_rate_n_per_s = trial.seed % 3 == 0 ? 20.0 : 4.0;
      press.approach_mm_per_s = 40.0;
      press.hold_s = 1.0;
      press.repetitions = 3;
      acts = {{0.0, press}, {8.5, waving()}};
      break;
    }
    case TrustMotion::kLeave: {
      sim::HandProgram press;
      press.kind = Kind::kPress;
      press.force_n = trial.seed % 2 == 0 ? 2.0 : 1.0;
      press.force_rate_n_per_s = 4.0;
      press.approach_mm_per_s = 30.0;
      press.hold_s = -1.0;
      sim::HandProgram leaves;
      leaves.place_mm = {0.0, 0.0, 15.0};
      leaves.travel_s = 20.0;
      acts = {{0.0, sim::HandProgram{}}, {5.0, press}, {14.0, leaves}, {36.0, press}, {39.0, waving()}};
      break;
    }
    case TrustMotion::kStroke: {
      sim::HandProgram stroke;
      stroke.kind = Kind::kStroke;
      stroke.force_n = trial.seed % 2 == 0 ? 2.0 : 3.0;
      stroke.force_rate_n_per_s = 4.0;
      stroke.approach_mm_per_s = 40.0;
      stroke.speed_mm_per_s = trial.seed % 2 == 0 ? 60.0 : 150.0;
      stroke.stroke_length_mm = 60.0;
      stroke.repetitions = 3;
      acts = {{0.0, stroke}, {14.0, waving()}};
      break;
    }
  }
  return acts;
}

/// A bias at the wrong moment.
struct WrongBias {
  hal::Vector3 force_n;
  std::uint32_t count = 0;

  /// True at the tick at which it is taken.
  bool apply(double at_n, const hal::TruthSample& truth, hal::RigSample& sample) {
    if (at_n <= 0.0) return false;
    const bool now = count == 0 && dot(truth.reaction_force_n, truth.reaction_force_n) >= at_n * at_n;
    if (now) {
      force_n = sample.sensor_force_n;
      count = 1;
    }
    sample.sensor_force_n = sample.sensor_force_n - force_n;
    sample.bias_serial += count;
    return now;
  }
};

}  // namespace

std::string TrustCase::text() const {
  return cause->label() + ", " + scene + ", " + device + ", " + std::to_string(std::lround(rate_hz)) +
         " Hz, seed " + std::to_string(seed) + (published ? ", published" : "");
}

std::vector<std::string> trust_scenes() {
  return {"tap_1d", "explore_rod", "explore_bearing", "wall"};
}
std::vector<std::string> trust_devices() {
  return {"phantom_1_0", "phantom_1_5_high_force"};
}

rt::SceneSpec trust_scene(const TrustCase& trial) {
  rt::SceneSpec scene;
  if (trial.scene == "explore_rod" || trial.scene == "explore_bearing") {
    const rt::Tip tip = trial.scene == "explore_rod" ? rt::Tip::kRod : rt::Tip::kBallBearing;
    scene = trial.published ? dissertation_scene(tip) : explore_scene(tip);
    scene.target = rt::linear_target(0.8);
  } else {
    scene.kind = trial.scene == "wall" ? rt::SceneKind::kWall : rt::SceneKind::kTap1d;
    if (scene.kind == rt::SceneKind::kWall) {
      scene.controller.law = rt::ControlLaw::kOpenLoop;
      scene.structural_compensation = false;
    }
    if (trial.published) {
      scene.contact.method = rt::ContactMethod::kFilteredAcceleration;
      scene.contact.evidence.required = false;
    }
    scene.target = rt::linear_target(0.7);
  }
  scene.name = trial.scene;
  scene.max_target_stiffness_n_per_mm = 0.0;  // the service's own
  scene.tool_mass_g = kExploreToolMassG;
  return scene;
}

sim::SimulationConfig trust_rig(const TrustCase& trial) {
  const char* object = !trial.cause->needs_object ? "none"
                       : trial.scene == "tap_1d"  ? "rubber_ball"
                                                  : "foam_ball_3d";
  sim::SimulationConfig rig =
      explore_rig(trial.device, object, trial.scene == "explore_bearing" ? "ball_bearing" : "rod");
  rig.rate_hz = trial.rate_hz;
  rig.seed = trial.seed;
  rig.external_instrument = false;
  trial.cause->apply(rig, trial.cause->value);
  return rig;
}

TrustOutcome run_trust_case(const TrustCase& trial, const TrustModels& models, std::vector<TrustTick>* trace,
                            double trace_from_s, double trace_to_s) {
  const auto rig = value_of(create_rig(trust_rig(trial)));
  rt::SceneSpec scene = value_of(rt::resolve(trust_scene(trial), rig->info()));
  if (trial.published) scene.guard.renders_real_object = false;  // it had no such guard
  const auto pipeline =
      value_of(rt::compose(scene, rig->info(), trial.published ? models.published : models.ours));
  rt::Renderer renderer(scene.guard, trial.rate_hz);
  if (trial.cause->biased_at_n == 0.0) renderer.exchange(pipeline.get(), scene.guard);

  TrustOutcome outcome;
  test::FreeAirJudge judge;
  double duration_s = 0.0;
  const std::vector<Act> acts = acts_of(trial, duration_s);
  std::size_t next_act = 0;
  hal::RigSample sample;
  hal::TruthSample truth;
  rt::TickRecord record;
  WrongBias bias;
  std::uint32_t contacts = 0;
  double silent_since_s = -1.0;
  double silent_s = 0.0;
  double last_s = 0.0;
  double touched_s = -1.0;
  for (double now_s = 0.0; now_s < duration_s;) {
    if (next_act < acts.size() && acts[next_act].from_s <= now_s)
      demand(rig->set_program(acts[next_act++].program));
    rig->read(sample);
    rig->truth(truth);
    if (bias.apply(trial.cause->biased_at_n, truth, sample)) renderer.exchange(pipeline.get(), scene.guard);
    record = rt::TickRecord{};
    rig->write(renderer.tick(sample, record));
    now_s = 1e-9 * static_cast<double>(sample.time_ns);
    // What is at the device until the next tick, next to what it touches by then.
    const double force_n = std::sqrt(dot(record.device_command_n, record.device_command_n));
    judge.add(now_s, truth.in_contact, force_n);
    if (truth.in_contact) touched_s = now_s;
    // Not a bounce, nor the contact that has just ended.
    constexpr double kAfterContactS = 0.1;
    if (record.contact_count > contacts && !truth.in_contact && now_s - touched_s > kAfterContactS) {
      outcome.declared += record.contact_count - contacts;
    }
    contacts = record.contact_count;
    if (trace != nullptr && now_s >= trace_from_s && now_s <= trace_to_s) {
      trace->push_back({now_s, force_n, truth.in_contact, record.in_contact});
    }
    // A user clears what is latched; a device that never renders again would prove nothing.
    if (record.guard_state == rt::GuardState::kLatched || record.guard_state == rt::GuardState::kSuspended) {
      if (!truth.in_contact) silent_s += now_s - last_s;
      if (silent_since_s < 0.0) silent_since_s = now_s;
      constexpr double kClearedAfterS = 0.3;
      if (now_s - silent_since_s > kClearedAfterS && renderer.clear()) silent_since_s = -1.0;
    } else {
      silent_since_s = -1.0;
    }
    last_s = now_s;
  }
  outcome.simulated_s = duration_s;
  outcome.free_s = judge.free_s();
  outcome.max_n = judge.max_n();
  outcome.max_at_s = judge.max_at_s();
  outcome.longest_ms = judge.longest_ms();
  outcome.longest_at_s = judge.longest_at_s();
  outcome.withdrawn = withdrawn_contacts(record);
  outcome.zero_n = followed_zero_n(record);
  outcome.silent_share = judge.free_s() > 0.0 ? silent_s / judge.free_s() : 0.0;
  outcome.holds = judge.holds();
  return outcome;
}

}  // namespace hapticd::study
