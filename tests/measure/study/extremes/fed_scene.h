#pragma once

#include <memory>

#include "hal/rig.h"
#include "hal/samples.h"
#include "rt/model/models.h"
#include "rt/record/tick_record.h"
#include "rt/scene/pipeline.h"
#include "rt/scene/renderer.h"
#include "rt/scene/scene_spec.h"

namespace hapticd::study::extremes {

/// The scene tap_1d as it ships, for a rig that has never been informed of limits.
rt::SceneSpec tap_scene();

/// A composed scene behind the guard, fed with samples from outside instead of by a rig. On the high-force
/// device. Throws std::runtime_error if the scene is refused.
class FedScene {
 public:
  FedScene(const rt::SceneSpec& scene, const rt::ObjectModel* model);

  rt::TickRecord tick(const hal::RigSample& sample) {
    rt::TickRecord record;
    renderer_->tick(sample, record);
    return record;
  }
  rt::Renderer& renderer() { return *renderer_; }
  const rt::SceneSpec& scene() const { return scene_; }
  const hal::RigInfo& info() const { return info_; }

 private:
  hal::RigInfo info_;
  rt::SceneSpec scene_;
  std::unique_ptr<rt::Pipeline> pipeline_;
  std::unique_ptr<rt::Renderer> renderer_;
};

}  // namespace hapticd::study::extremes
