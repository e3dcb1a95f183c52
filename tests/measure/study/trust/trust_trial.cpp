#include "tests/measure/study/trust/trust_trial.h"

#include <algorithm>
#include <cmath>

#include "rt/scene/compose.h"
#include "tests/measure/study/common/hands.h"
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

/// Presses and does not let go.
sim::HandProgram pressing_at_once(double force_n) {
  sim::HandProgram press = pressing(force_n);
  press.force_rate_n_per_s = 4.0;
  press.approach_mm_per_s = 40.0;
  return press;
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
    case TrustMotion::kPress:
      acts = {{0.0, pressing_at_once(trial.seed % 2 == 0 ? 2.0 : 4.0)}, {8.5, waving()}};
      break;
    case TrustMotion::kPressOften: {
      sim::HandProgram press =
          pressing_at_once(std::max(trial.seed % 2 == 0 ? 2.0 : 1.0, 1.1 * trial.cause->biased_at_n));
      press.force_rate_n_per_s = trial.seed % 3 == 0 ? 20.0 : 4.0;
      press.hold_s = 1.0;
      press.repetitions = 3;
      acts = {{0.0, press}, {8.5, waving()}};
      break;
    }
    case TrustMotion::kLeave: {
      sim::HandProgram press = pressing_at_once(trial.seed % 2 == 0 ? 2.0 : 1.0);
      press.approach_mm_per_s = 30.0;
      sim::HandProgram leaves;
      leaves.place_mm = {0.0, 0.0, 15.0};
      leaves.travel_s = 20.0;
      acts = {{0.0, sim::HandProgram{}}, {5.0, press}, {14.0, leaves}, {36.0, press}, {39.0, waving()}};
      break;
    }
    case TrustMotion::kStroke: {
      const bool is_even = trial.seed % 2 == 0;
      sim::HandProgram stroke = stroking(is_even ? 2.0 : 3.0, is_even ? 60.0 : 150.0, 60.0, 40.0);
      stroke.repetitions = 3;
      acts = {{0.0, stroke}, {14.0, waving()}};
      break;
    }
  }
  return acts;
}

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

TrustRun::TrustRun(const TrustCase& trial, const TrustModels& models, const sim::SimulationConfig& rig,
                   rt::SceneSpec scene, std::vector<Act> acts)
    : biased_at_n_(trial.cause->biased_at_n), acts_(std::move(acts)), rig_(value_of(create_rig(rig))) {
  scene = value_of(rt::resolve(std::move(scene), rig_->info()));
  if (trial.published) scene.guard.renders_real_object = false;  // it had no such guard
  limits_ = scene.guard;
  pipeline_ = value_of(rt::compose(scene, rig_->info(), trial.published ? models.published : models.ours));
  renderer_ = std::make_unique<rt::Renderer>(limits_, trial.rate_hz);
  if (biased_at_n_ == 0.0) renderer_->exchange(pipeline_.get(), limits_);
}

TrustRun::~TrustRun() = default;

/// Takes a bias at the wrong moment, and loads the scene then.
void TrustRun::bias_wrongly() {
  if (biases_ == 0 && dot(truth.reaction_force_n, truth.reaction_force_n) >= biased_at_n_ * biased_at_n_) {
    bias_n_ = sample.sensor_force_n;
    biases_ = 1;
    renderer_->exchange(pipeline_.get(), limits_);
  }
  sample.sensor_force_n = sample.sensor_force_n - bias_n_;
  sample.bias_serial += biases_;
}

void TrustRun::step() {
  if (next_act_ < acts_.size() && acts_[next_act_].from_s <= now_s) {
    act = acts_[next_act_].program.kind;
    demand(rig_->set_program(acts_[next_act_++].program));
  }
  rig_->read(sample);
  rig_->truth(truth);
  if (biased_at_n_ > 0.0) bias_wrongly();
  record = rt::TickRecord{};
  rig_->write(renderer_->tick(sample, record));
  before_s = now_s;
  now_s = 1e-9 * static_cast<double>(sample.time_ns);
  silent = record.guard_state == rt::GuardState::kLatched || record.guard_state == rt::GuardState::kSuspended;
  if (silent && silent_since_s_ < 0.0) silent_since_s_ = now_s;
  constexpr double kClearedAfterS = 0.3;
  if (!silent || (now_s - silent_since_s_ > kClearedAfterS && renderer_->clear())) silent_since_s_ = -1.0;
}

TrustOutcome run_trust_case(const TrustCase& trial, const TrustModels& models) {
  TrustOutcome outcome;
  test::FreeAirJudge judge;
  double duration_s = 0.0;
  std::vector<Act> acts = acts_of(trial, duration_s);
  TrustRun run(trial, models, trust_rig(trial), trust_scene(trial), std::move(acts));
  std::uint32_t contacts = 0;
  double silent_s = 0.0;
  double touched_s = -1.0;
  while (run.now_s < duration_s) {
    run.step();
    // What is at the device until the next tick, next to what it touches by then.
    const hal::Vector3& command = run.record.device_command_n;
    judge.add(run.now_s, run.truth.in_contact, std::sqrt(dot(command, command)));
    if (run.truth.in_contact) touched_s = run.now_s;
    // Not a bounce, nor the contact that has just ended.
    constexpr double kAfterContactS = 0.1;
    if (run.record.contact_count > contacts && !run.truth.in_contact &&
        run.now_s - touched_s > kAfterContactS) {
      outcome.declared += run.record.contact_count - contacts;
    }
    contacts = run.record.contact_count;
    if (run.silent && !run.truth.in_contact) silent_s += run.now_s - run.before_s;
  }
  outcome.simulated_s = duration_s;
  outcome.free_s = judge.free_s();
  outcome.max_n = judge.max_n();
  outcome.max_at_s = judge.max_at_s();
  outcome.longest_ms = judge.longest_ms();
  outcome.longest_at_s = judge.longest_at_s();
  outcome.withdrawn = run.record.withdrawn_count;
  outcome.silent_share = judge.free_s() > 0.0 ? silent_s / judge.free_s() : 0.0;
  outcome.holds = judge.holds();
  return outcome;
}

}  // namespace hapticd::study
