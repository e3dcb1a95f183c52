#include "tests/study/rig/virtual_run.h"

#include <optional>
#include <stdexcept>

#include "rt/scene/compose.h"

namespace hapticd::study {

namespace {
template <class T>
T value_of(hal::Result<T> result) {
  if (!result) throw std::runtime_error(result.error().text());
  return std::move(*result);
}
}  // namespace

VirtualRun::VirtualRun(const sim::SimulationConfig& rig, const rt::SceneSpec& scene, bool with_scene,
                       const rt::ObjectModel* model)
    : rig_(value_of(sim::SimulatedRig::create(rig))),
      scene_(value_of(rt::resolve(scene, rig_->info()))),
      pipeline_(value_of(rt::compose(scene_, rig_->info(), model))),
      renderer_(std::make_unique<rt::Renderer>(scene_.guard, rig.rate_hz)) {
  if (with_scene) renderer_->exchange(pipeline_.get(), scene_.guard);
}

VirtualRun::~VirtualRun() = default;
VirtualRun::VirtualRun(VirtualRun&&) noexcept = default;

void VirtualRun::set_hand(const sim::HandProgram& program) {
  if (const std::optional<hal::Error> error = rig_->set_program(program))
    throw std::runtime_error(error->text());
}

void VirtualRun::step() {
  rig_->read(sample_);
  record_ = rt::TickRecord{};
  rig_->write(renderer_->tick(sample_, record_));
  rig_->truth(truth_);
}

}  // namespace hapticd::study
