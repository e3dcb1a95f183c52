#include "tests/bench/tick/tick_workload.h"

#include <algorithm>

#include "hal/sim/simulated_rig.h"
#include "rt/scene/compose.h"

namespace hapticd::bench {
namespace {

constexpr int kSettleTicks = 1000;
constexpr std::size_t kRecordedTicks = 2000;

struct Scene {
  rt::SceneSpec spec;
  const char* object = "none";
};

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
  return hal::Error{"unknown scene", "hapticd_bench tick", name, "tap_1d, wall", ""};
}

}  // namespace

const std::vector<std::string>& tick_scenes() {
  static const std::vector<std::string> names{"tap_1d", "wall"};
  return names;
}

TickWorkload::TickWorkload(const rt::SceneSpec& resolved, std::unique_ptr<rt::Pipeline> pipeline,
                           double rate_hz)
    : pipeline_(std::move(pipeline)), renderer_(resolved.guard, rate_hz) {
  renderer_.exchange(pipeline_.get(), resolved.guard);
}

hal::Result<std::unique_ptr<TickWorkload>> TickWorkload::create(const std::string& name) {
  const auto scene = scene_named(name);
  if (!scene) return scene.error();
  sim::SimulationConfig config;
  config.object = scene->object;
  const auto rig = sim::SimulatedRig::create(config);
  if (!rig) return rig.error();
  sim::HandProgram taps;
  taps.kind = sim::HandProgram::Kind::kTap;
  taps.speed_mm_per_s = 200.0;
  taps.rate_hz = 2.5;
  taps.repetitions = -1;
  if (auto error = (*rig)->set_program(taps)) return *error;

  const auto resolved = rt::resolve(scene->spec, (*rig)->info());
  if (!resolved) return resolved.error();
  auto pipeline = rt::compose(*resolved, (*rig)->info());
  if (!pipeline) return pipeline.error();
  std::unique_ptr<TickWorkload> workload(new TickWorkload(*resolved, std::move(*pipeline), config.rate_hz));

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

double TickWorkload::contact_share() const noexcept {
  return static_cast<double>(std::count(in_contact_.begin(), in_contact_.end(), true)) /
         static_cast<double>(in_contact_.size());
}

}  // namespace hapticd::bench
