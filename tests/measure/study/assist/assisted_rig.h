#pragma once

#include <cmath>
#include <memory>
#include <utility>

#include "hal/sim/simulated_rig.h"
#include "rt/scene/compose.h"
#include "rt/scene/renderer.h"
#include "tests/support/value_of.h"

namespace hapticd::study {

/// A scene on a simulated rig in virtual time, with the guide, the fixture and the watch.
class AssistedRig {
 public:
  AssistedRig(const sim::SimulationConfig& rig, rt::SceneSpec spec)
      : rig_(test::value_of(sim::SimulatedRig::create(rig))) {
    scene_ = test::value_of(rt::resolve(std::move(spec), rig_->info()));
    pipeline_ = test::value_of(rt::compose(scene_, rig_->info()));
    renderer_ = std::make_unique<rt::Renderer>(scene_.guard, rig_->info().rate_hz);
    renderer_->exchange(pipeline_.get(), scene_.guard, rt::assistance_of(scene_));
  }

  void set_hand(const sim::HandProgram& program) {
    test::demand(rig_->set_program(program));
  }
  rt::Assistance& assistance() { return renderer_->assistance(); }
  rt::Renderer& renderer() { return *renderer_; }

  void tick() {
    hal::RigSample sample;
    rig_->read(sample);
    rig_->truth(truth_);
    record_ = {};
    rig_->write(renderer_->tick(sample, record_));
  }
  /// `observe()` after each tick of so long.
  template <class Observe>
  void run(double duration_s, Observe observe) {
    const auto ticks = std::lround(duration_s * rig_->info().rate_hz);
    for (long i = 0; i < ticks; ++i) {
      tick();
      observe();
    }
  }
  void run(double duration_s) {
    run(duration_s, [] {});
  }
  const rt::TickRecord& record() const { return record_; }
  const hal::TruthSample& truth() const { return truth_; }

 private:
  std::unique_ptr<sim::SimulatedRig> rig_;
  rt::SceneSpec scene_;
  std::unique_ptr<rt::Pipeline> pipeline_;
  std::unique_ptr<rt::Renderer> renderer_;
  rt::TickRecord record_;
  hal::TruthSample truth_;
};

}  // namespace hapticd::study
