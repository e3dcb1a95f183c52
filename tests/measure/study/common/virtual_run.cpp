#include "tests/measure/study/common/virtual_run.h"

#include "rt/scene/compose.h"
#include "tests/measure/study/common/plant.h"
#include "tests/support/value_of.h"

namespace hapticd::study {

using test::demand;
using test::value_of;

VirtualRun::VirtualRun(const sim::SimulationConfig& rig, const rt::SceneSpec& scene, bool with_scene,
                       const rt::ObjectModel* model)
    : rig_(value_of(create_rig(rig))),
      scene_(value_of(rt::resolve(scene, rig_->info()))),
      pipeline_(value_of(rt::compose(scene_, rig_->info(), model))),
      renderer_(std::make_unique<rt::Renderer>(scene_.guard, rig.rate_hz)) {
  // The published pipeline, which renders without evidence, had no guard of free air either.
  if (!scene_.contact.evidence.required) scene_.guard.renders_real_object = false;
  if (with_scene) renderer_->exchange(pipeline_.get(), scene_.guard, rt::assistance_of(scene_));
}

VirtualRun::~VirtualRun() = default;
VirtualRun::VirtualRun(VirtualRun&&) noexcept = default;

void VirtualRun::set_hand(const sim::HandProgram& program) {
  demand(rig_->set_program(program));
}

void VirtualRun::step() {
  rig_->read(sample_);
  record_ = rt::TickRecord{};
  rig_->write(renderer_->tick(sample_, record_));
  rig_->truth(truth_);
}

}  // namespace hapticd::study
