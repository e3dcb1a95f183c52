#include "tests/measure/study/common/shadow.h"

#include "rt/scene/compose.h"
#include "tests/measure/study/common/scenes.h"
#include "tests/support/value_of.h"

namespace hapticd::study {

using test::value_of;

Shadow::Shadow(const hal::RigInfo& rig, const rt::SceneSpec& scene, const rt::ObjectModel& model)
    : pipeline_(value_of(rt::compose(value_of(rt::resolve(scene, rig)), rig, &model))) {}

void Shadow::watch(const hal::RigSample& sample) {
  record_ = rt::TickRecord{};
  pipeline_->evaluate(sample);
  pipeline_->fill_record(record_);
  pipeline_->applied({});
}

VirtualRun unrendered(const sim::SimulationConfig& rig) {
  rt::SceneSpec scene = explore_scene(rt::Tip::kBallBearing);
  scene.explore.displacement = rt::DisplacementEstimator::kRecursive;  // the one that needs no model
  return VirtualRun(rig, scene, false);
}

}  // namespace hapticd::study
