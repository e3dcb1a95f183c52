#include "tests/measure/bench/tick/tick_workload.h"

#include <malloc.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <optional>

#include "hal/sim/simulated_rig.h"
#include "rt/scene/compose.h"
#include "tests/measure/bench/tick/everything.h"

namespace hapticd::bench {
namespace {

constexpr int kSettleTicks = 1000;
constexpr std::size_t kRecordedTicks = 2000;

struct Scene {
  rt::SceneSpec spec;
  const char* object = "none";
  const char* tip = "rod";
  std::optional<rt::ObjectModel> model{};
};

/// A model of plausible size for the foam ball; what a tick costs does not depend on its numbers.
rt::ObjectModel foam_model() {
  rt::ObjectModel model;
  model.name = "foam_ball_3d";
  model.max_displacement_mm = 20.0;
  model.max_force_n = 12.0;
  model.hunt_crossley = {{0.085, 2.3e-4, 1.57}, 0.11};
  rt::CreepParameters creep;
  creep.weight = {0.64, 0.17, 0.05, 0.06, 0.08};
  creep.max_force_n = 10.0;
  for (std::size_t j = 0; j < rt::CreepParameters::kKnots; ++j) {
    const double share = static_cast<double>(j) / (rt::CreepParameters::kKnots - 1);
    creep.displacement_mm[j] = 22.0 * std::pow(share, 1.3);
  }
  model.creep = {creep, 0.02};
  model.rod_friction = {0.57, 0.13, 1e-3};
  return model;
}

hal::Result<Scene> scene_named(const std::string& name) {
  Scene scene;
  scene.spec.name = name;
  if (name == "tap_1d") {
    scene.spec.kind = rt::SceneKind::kTap1d;
    scene.object = "sponge_block";
    return scene;
  }
  if (name == "wall") {
    scene.spec.kind = rt::SceneKind::kWall;
    scene.spec.structural_compensation = false;
    scene.spec.controller.law = rt::ControlLaw::kOpenLoop;
    return scene;
  }
  if (name == "explore_rod" || name == "explore_bearing" || name == "explore_dissertation" ||
      name == "explore_rod_friction" || name == "explore_rod_taps" || name == "explore_rod_transient") {
    scene.spec.kind = rt::SceneKind::kExplore;
    scene.spec.tool_mass_g = 12.59;
    scene.spec.contact.threshold_n = 0.02;
    scene.object = "foam_ball_3d";
    scene.model = foam_model();
    if (name == "explore_rod_friction") scene.spec.friction_target.emplace().scale = 1.5;
    if (name == "explore_rod_transient") scene.spec.transient.emplace().target = {{100.0, 80.0, 15.0}};
    if (name == "explore_bearing") {
      scene.spec.tip = rt::Tip::kBallBearing;
      scene.tip = "ball_bearing";
    }
    if (name == "explore_dissertation") {  // as published: it oscillates here, so that it is only a part of all
      scene.spec.tip = rt::Tip::kBallBearing;
      scene.tip = "ball_bearing";
      rt::ExploreParameters& explore = scene.spec.explore;
      explore.direction = rt::DirectionMethod::kPublished;
      explore.displacement = rt::DisplacementEstimator::kInverse;
      explore.law = rt::ContactLawKind::kHuntCrossley;
      explore.friction_feel = rt::FrictionFeel::kCancelled;
      explore.release = rt::ReleaseMethod::kCut;
      explore.passivity = false;
      scene.spec.compensation = {0.0, 0.0, false};
    }
    return scene;
  }
  return hal::Error{"unknown scene", "hapticd_bench tick", name,
                    "tap_1d, wall, explore_bearing, explore_rod, explore_rod_friction, explore_rod_taps, "
                    "explore_rod_transient",
                    ""};
}

/// `own` and, behind it, one pipeline of every kind with every option it has: full creep and fusion,
/// passivity, friction of a rod, published direction and inverse law next to it, structural compensation,
/// closed loops.
hal::Result<std::unique_ptr<rt::Pipeline>> with_everything(std::unique_ptr<rt::Pipeline> own,
                                                           const hal::RigInfo& rig) {
  std::vector<std::unique_ptr<rt::Pipeline>> stages;
  stages.push_back(std::move(own));
  for (const char* name : {"tap_1d", "wall", "explore_rod", "explore_dissertation"}) {
    const auto scene = scene_named(name);
    if (!scene) return scene.error();
    const auto resolved = rt::resolve(scene->spec, rig);
    if (!resolved) return resolved.error();
    auto pipeline = rt::compose(*resolved, rig, scene->model ? &*scene->model : nullptr);
    if (!pipeline) return pipeline.error();
    stages.push_back(std::move(*pipeline));
  }
  return std::unique_ptr<rt::Pipeline>(std::make_unique<Everything>(std::move(stages)));
}

}  // namespace

const std::vector<std::string>& tick_scenes() {
  static const std::vector<std::string> names{"tap_1d",
                                              "wall",
                                              "explore_bearing",
                                              "explore_rod",
                                              "explore_rod_friction",
                                              "explore_rod_taps",
                                              "explore_rod_transient"};
  return names;
}

TickWorkload::TickWorkload(const rt::SceneSpec& resolved, std::unique_ptr<rt::Pipeline> pipeline,
                           double rate_hz)
    : pipeline_(std::move(pipeline)),
      renderer_(resolved.guard, rate_hz),
      period_ns_(static_cast<std::int64_t>(1e9 / rate_hz)) {
  renderer_.exchange(pipeline_.get(), resolved.guard);
}

hal::Result<std::unique_ptr<TickWorkload>> TickWorkload::create(const std::string& name, Extent extent) {
  const auto scene = scene_named(name);
  if (!scene) return scene.error();
  sim::SimulationConfig config;
  config.object = scene->object;
  config.tip = scene->tip;
  config.tool_mass_g = scene->spec.tool_mass_g;
  const auto rig = sim::SimulatedRig::create(config);
  if (!rig) return rig.error();
  sim::HandProgram taps;
  taps.kind = sim::HandProgram::Kind::kTap;
  taps.speed_mm_per_s = 200.0;
  taps.rate_hz = 2.5;
  taps.repetitions = -1;
  sim::HandProgram hand = taps;
  const bool is_tapped = name == "explore_rod_taps" || name == "explore_rod_transient";
  if (scene->model && !is_tapped) {  // strokes back and forth, with the tool swaying
    hand = sim::HandProgram{};
    hand.kind = sim::HandProgram::Kind::kStroke;
    hand.force_n = 3.0;
    hand.speed_mm_per_s = 120.0;
    hand.stroke_length_mm = 40.0;
    hand.repetitions = -1;
    hand.approach_mm_per_s = 100.0;
    hand.force_rate_n_per_s = 10.0;
    hand.tilt_deg = 10.0;
  }
  if (auto error = (*rig)->set_program(hand)) return *error;

  const std::size_t before_bytes = mallinfo2().uordblks;
  const auto start = std::chrono::steady_clock::now();
  const auto resolved = rt::resolve(scene->spec, (*rig)->info());
  if (!resolved) return resolved.error();
  auto pipeline = rt::compose(*resolved, (*rig)->info(), scene->model ? &*scene->model : nullptr);
  if (!pipeline) return pipeline.error();
  if (extent == Extent::kEverything) {
    auto everything = with_everything(std::move(*pipeline), (*rig)->info());
    if (!everything) return everything.error();
    pipeline = std::move(everything);
  }
  const std::chrono::duration<double, std::nano> composing = std::chrono::steady_clock::now() - start;
  const std::size_t pipeline_bytes = mallinfo2().uordblks - before_bytes;
  std::unique_ptr<TickWorkload> workload(new TickWorkload(*resolved, std::move(*pipeline), config.rate_hz));
  workload->outline_ = rt::outline(*resolved);
  workload->compose_ns_ = composing.count();
  workload->memory_bytes_ = pipeline_bytes + sizeof(rt::Renderer);

  // The scene renders while it is recorded, so that the samples are those it meets at work.
  hal::RigSample sample;
  for (std::size_t i = 0; i < kSettleTicks + kRecordedTicks; ++i) {
    rt::TickRecord record;
    (*rig)->read(sample);
    (*rig)->write(workload->renderer_.tick(sample, record));
    if (i < kSettleTicks) continue;
    workload->samples_.push_back(sample);
    workload->in_contact_.push_back(record.in_contact);
  }
  return workload;
}

rt::TickRecord TickWorkload::next_record() noexcept {
  rt::TickRecord record;
  renderer_.tick(samples_[next_], record);
  if (++next_ == samples_.size()) next_ = 0;
  return record;
}

void TickWorkload::lay_down() noexcept {
  still_ = samples_[(next_ + samples_.size() - 1) % samples_.size()];
  still_.sensor_force_n = still_.sensor_torque_n_mm = {};
}

double TickWorkload::contact_share() const noexcept {
  return static_cast<double>(std::count(in_contact_.begin(), in_contact_.end(), true)) /
         static_cast<double>(in_contact_.size());
}

}  // namespace hapticd::bench
