#include "tests/measure/study/trust/settings_search.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <random>
#include <vector>

#include "rt/scene/compose.h"
#include "rt/scene/renderer.h"
#include "rt/target/largest_target.h"
#include "server/scene/scene_file.h"
#include "server/scene/scene_models.h"
#include "tests/measure/study/common/scenes.h"
#include "tests/support/free_air_judge.h"
#include "tests/support/value_of.h"

namespace hapticd::study {

namespace {

using sim::HandProgram;
using test::demand;
using test::value_of;

/// Numbers over a range, its borders with a fifth of the chance each.
class Draw {
 public:
  explicit Draw(std::uint64_t seed) : random_(seed) {}
  double unit() { return std::uniform_real_distribution<double>(0.0, 1.0)(random_); }
  bool chance(double share) { return unit() < share; }
  int of(int count) { return std::uniform_int_distribution<int>(0, count - 1)(random_); }
  double between(double low, double high) {
    const double u = unit();
    return u < 0.2 ? low : u > 0.8 ? high : low + (high - low) * unit();
  }
  double log_between(double low, double high) {
    return std::exp(between(std::log(low), std::log(high)));
  }
  /// Mostly left as it is.
  void change(double& value, double low, double high) {
    if (chance(0.4)) value = log_between(low, high);
  }

 private:
  std::mt19937_64 random_;
};

rt::TargetLaw drawn_target(Draw& draw, bool any_law) {
  rt::TargetLaw law;
  law.kind = any_law ? static_cast<rt::TargetLaw::Kind>(draw.of(4)) : rt::TargetLaw::Kind::kLinear;
  law.stiffness_n_per_mm = draw.between(0.0, 1.0);
  law.hunt_crossley = {draw.log_between(1e-4, 1.0), draw.log_between(1e-6, 1.0), draw.between(1.0, 3.0)};
  law.knot_count = static_cast<std::uint32_t>(1 + draw.of(4));
  double at_mm = law.kind == rt::TargetLaw::Kind::kPositionProfile ? -20.0 : 0.0;
  for (std::uint32_t i = 0; i < law.knot_count; ++i) {
    law.knots[i] = {at_mm, draw.between(0.0, 1.0)};
    at_mm += draw.log_between(1e-3, 20.0);
  }
  return law;
}

void draw_explore(Draw& draw, rt::SceneSpec& scene) {
  rt::ExploreParameters& e = scene.explore;
  e.displacement = static_cast<rt::DisplacementEstimator>(draw.of(3));
  e.direction = static_cast<rt::DirectionMethod>(draw.of(2));
  e.law = static_cast<rt::ContactLawKind>(draw.of(2));
  e.release = static_cast<rt::ReleaseMethod>(draw.of(3));
  if (draw.chance(0.3)) e.friction_feel = rt::FrictionFeel::kCancelled;
  if (draw.chance(0.3)) e.passivity = false;
  if (draw.chance(0.2)) e.modulated = false;
  draw.change(e.deflection_cutoff_hz, 0.1, 400.0);
  draw.change(e.force_noise_n, 1e-5, 1.0);
  draw.change(scene.compensation.lead_ms, 0.1, 50.0);
  if (draw.chance(0.2)) {
    rt::InclusionParameters inclusion;
    inclusion.place_mm = {draw.between(-20.0, 20.0), 0.0, -draw.between(5.0, 60.0)};
    inclusion.response = {draw.log_between(1e-4, 100.0), draw.log_between(1e-6, 1.0), draw.between(1.0, 4.0)};
    inclusion.max_displacement_mm = draw.between(0.5, 20.0);
    if (draw.chance(0.3)) inclusion.variant = rt::InclusionVariant::kPublished;
    scene.inclusions.push_back(inclusion);
  }
  if (scene.tip == rt::Tip::kRod && draw.chance(0.2)) {
    scene.friction_target.emplace().scale = draw.between(0.15, 3.0);
  }
  if (draw.chance(0.2)) {
    rt::TransientParameters& transient = scene.transient.emplace();
    transient.target.push_back({draw.between(10.0, 150.0), draw.between(30.0, 1000.0), draw.between(0.0, 1000.0)});
    transient.max_force_n = draw.between(0.1, 8.0);
  }
}

rt::SceneSpec drawn_scene(Draw& draw) {
  rt::SceneSpec scene;
  switch (draw.of(3)) {
    case 0:
      scene.name = "tap";
      break;
    case 1:
      scene = explore_scene(rt::Tip::kRod);
      break;
    default:
      scene = explore_scene(rt::Tip::kBallBearing);
      break;
  }
  const bool explores = scene.kind == rt::SceneKind::kExplore;
  scene.max_target_stiffness_n_per_mm = draw.chance(0.5) ? 0.0 : draw.between(0.5, 3.0);
  scene.tool_mass_g = draw.chance(0.6) ? kExploreToolMassG : draw.between(1.0, 500.0);
  scene.target = drawn_target(draw, explores);
  draw.change(scene.target_ramp_s, 1e-3, 1.0);
  draw.change(scene.max_target_change_n_per_s, 0.1, 1e6);
  scene.controller.proportional_gain = draw.chance(0.3) ? 0.0 : draw.log_between(1e-4, 2.0);
  if (draw.chance(0.4)) scene.controller.derivative_gain_ms = draw.between(-1.0, 1.0);
  if (draw.chance(0.1)) scene.controller.law = rt::ControlLaw::kOpenLoop;
  rt::ContactParameters& c = scene.contact;
  if (draw.chance(0.1)) c.method = rt::ContactMethod::kFilteredAcceleration;
  draw.change(c.threshold_n, 0.005, 0.2);
  draw.change(c.release_ratio, 0.01, 1.0);
  draw.change(c.release_time_ms, 0.1, 100.0);
  draw.change(c.release_clearance_mm, 0.01, 20.0);
  draw.change(c.quiet_time_ms, 0.1, 100.0);
  draw.change(c.arming_time_ms, 0.1, 50.0);
  draw.change(c.evidence.unexplained_force_n, 0.01, 1.0);
  draw.change(c.evidence.lowest_stiffness_n_per_mm, 0.002, 10.0);
  draw.change(c.zero_bound_n, 0.02, 1.0);
  if (draw.chance(0.3)) scene.structural_compensation = false;
  draw.change(scene.structural_stiffness_n_per_mm, 0.01, 1e3);
  if (draw.chance(0.3)) scene.compensation.reaction_lead_share = draw.between(0.0, 1.0);
  if (draw.chance(0.3)) scene.compensation.back_drive = false;
  draw.change(scene.guard.max_force_rate_n_per_s, 10.0, 1e6);
  draw.change(scene.guard.max_power_w, 0.1, 100.0);
  if (explores) draw_explore(draw, scene);
  return scene;
}

/// Models of the rig as an import takes them, some of them.
server::RigModels drawn_models(Draw& draw) {
  const auto stored = [](rt::ModelContent content) {
    server::StoredModel model;
    model.hash = "drawn";
    model.model.content = std::move(content);
    model.model.device = "phantom_1_0";
    return std::make_shared<const server::StoredModel>(std::move(model));
  };
  server::RigModels models;
  if (draw.chance(0.5)) models.gains = stored(rt::GainsModel{draw.log_between(1e-3, 2.0), draw.between(-1.0, 1.0), 1.0, 10.0});
  if (draw.chance(0.3)) models.threshold = stored(rt::ThresholdModel{draw.log_between(0.005, 0.5), 0.01, 60.0});
  if (draw.chance(0.3)) {
    rt::StructuralModel structure;
    structure.stiffness_n_per_mm = draw.log_between(0.1, 100.0);
    models.structure = stored(structure);
  }
  return models;
}

HandProgram drawn_hand(Draw& draw) {
  HandProgram hand;
  if (draw.chance(0.7)) {
    hand.kind = HandProgram::Kind::kTap;
    hand.speed_mm_per_s = draw.between(100.0, 400.0);
    hand.rate_hz = 3.0;
  } else {
    hand.kind = HandProgram::Kind::kPress;
    hand.force_n = draw.between(0.5, 6.0);
    hand.force_rate_n_per_s = draw.between(4.0, 40.0);
    hand.approach_mm_per_s = 60.0;
    hand.hold_s = 0.1;
  }
  hand.repetitions = -1;
  return hand;
}

/// What is rendered until the next scene.
struct Rendered {
  rt::SceneSpec spec;
  std::unique_ptr<rt::Pipeline> pipeline;
  std::string text;
};

class Search {
 public:
  Search(std::uint64_t seed, const rt::ObjectModel& model) : draw_(seed), model_(model) {
    const std::vector<std::string> objects{"sponge_block", "foam_ball", "rubber_ball", "rubber_eraser"};
    sim::SimulationConfig config =
        explore_rig(seed % 2 == 0 ? "phantom_1_0" : "phantom_1_5_high_force", objects[seed / 2 % 4], "rod");
    config.rate_hz = seed % 7 == 3 ? 500.0 : seed % 7 == 5 ? 2000.0 : 1000.0;
    config.seed = seed;
    config.external_instrument = false;
    rig_ = value_of(sim::SimulatedRig::create(config));
    demand(rig_->set_program(drawn_hand(draw_)));
    renderer_ = std::make_unique<rt::Renderer>(rt::GuardLimits{}, config.rate_hz);
  }

  SettingsOutcome run(int count, std::string* hardest_text, std::string* roughest_text) {
    for (int i = 0; i < count; ++i) {
      const double before_n = outcome_.free_air_max_n;
      const double step_n = outcome_.step_max_n;
      exchange();
      render_one_contact();
      if (outcome_.free_air_max_n > before_n) {
        outcome_.hardest = i;
        if (hardest_text != nullptr) *hardest_text = server::write_scene(rendered_.spec);
      }
      if (outcome_.step_max_n > step_n) {
        outcome_.roughest = i;
        if (roughest_text != nullptr) *roughest_text = server::write_scene(rendered_.spec);
      }
    }
    renderer_->exchange(nullptr, rendered_.spec.guard);
    return outcome_;
  }

 private:
  /// The next that is accepted.
  void exchange() {
    for (;;) {
      rt::SceneSpec drawn = drawn_scene(draw_);
      const server::RigModelUse use =
          server::use_rig_models(drawn_models(draw_), drawn, rig_->info(), server::ZeroInForce{});
      auto resolved = rt::resolve(std::move(drawn), rig_->info());
      if (!resolved) {
        ++outcome_.refused;
        continue;
      }
      auto pipeline = rt::compose(*resolved, rig_->info(), &model_);
      if (!pipeline) {
        ++outcome_.refused;
        continue;
      }
      outcome_.models += static_cast<double>(use.stored.size());
      ++outcome_.scenes;
      renderer_->exchange(pipeline->get(), resolved->guard, rt::assistance_of(*resolved));
      rendered_ = {std::move(*resolved), std::move(*pipeline), {}};
      return;
    }
  }

  void set_target() {
    rt::TargetLaw law = drawn_target(draw_, rendered_.spec.kind == rt::SceneKind::kExplore);
    if (rt::check(law, "drawn")) return;
    const double limit = rendered_.spec.max_target_stiffness_n_per_mm;
    if (rt::greatest_stiffness_n_per_mm(law, rt::kMaxTargetDepthMm) > limit) return;
    renderer_->set_target(law, draw_.between(0.1, 1.0));  // the shortest ramp of [guard]
    ++outcome_.targets;
  }

  void render_one_contact() {
    constexpr double kMaxS = 2.0;
    constexpr double kAfterS = 0.08;
    constexpr double kContactS = 0.3;
    // A force that the scene before gave is not counted here. The time since the last contact does not start again.
    test::FreeAirJudge judge;
    judge.add(touched_until_s_, true, 0.0);
    bool was_touching = false;
    const double began_s = now_s_;
    double left_s = -1.0;
    double touched_s = -1.0;
    const bool changes_target = draw_.chance(0.5);
    bool has_changed = false;
    while (now_s_ - began_s < kMaxS) {
      rig_->read(sample_);
      rig_->truth(truth_);
      record_ = {};
      rig_->write(renderer_->tick(sample_, record_));
      now_s_ = 1e-9 * static_cast<double>(sample_.time_ns);
      const hal::Vector3& command = record_.device_command_n;
      const double force_n = std::sqrt(dot(command, command));
      judge.add(now_s_, truth_.in_contact, force_n);
      const hal::Vector3 change = command - last_n_;
      const bool is_cut = record_.guard_state != rt::GuardState::kRendering;
      if (!is_cut) outcome_.step_max_n = std::max(outcome_.step_max_n, std::sqrt(dot(change, change)));
      last_n_ = command;
      if (record_.guard_state == rt::GuardState::kLatched && force_n == 0.0) renderer_->clear();
      if (truth_.in_contact) {
        touched_until_s_ = now_s_;
        outcome_.contact_max_n = std::max(outcome_.contact_max_n, force_n);
        if (!was_touching) touched_s = now_s_;
        if (changes_target && !has_changed && now_s_ - touched_s > 0.01) {
          set_target();
          has_changed = true;
        }
        was_touching = true;
        left_s = now_s_;
      } else if (was_touching && now_s_ - left_s > kAfterS) {
        break;
      }
      if (touched_s > 0.0 && now_s_ - touched_s > 4.0 * kContactS) break;
    }
    if (draw_.chance(0.05)) demand(rig_->set_program(drawn_hand(draw_)));
    outcome_.free_s += judge.free_s();
    outcome_.free_air_max_n = std::max(outcome_.free_air_max_n, judge.max_n());
    outcome_.longest_ms = std::max(outcome_.longest_ms, judge.longest_ms());
  }

  Draw draw_;
  const rt::ObjectModel& model_;
  std::unique_ptr<sim::SimulatedRig> rig_;
  std::unique_ptr<rt::Renderer> renderer_;
  Rendered rendered_;
  hal::RigSample sample_;
  hal::TruthSample truth_;
  rt::TickRecord record_;
  hal::Vector3 last_n_;
  double now_s_ = 0.0;
  double touched_until_s_ = -1.0;
  SettingsOutcome outcome_;
};

}  // namespace

SettingsOutcome search_settings(std::uint64_t seed, int count, const rt::ObjectModel& model,
                                std::string* hardest_text, std::string* roughest_text) {
  return Search(seed, model).run(count, hardest_text, roughest_text);
}

}  // namespace hapticd::study
