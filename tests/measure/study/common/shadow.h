#pragma once

#include <memory>
#include <string>

#include "rt/model/models.h"
#include "rt/scene/pipeline.h"
#include "rt/scene/scene_spec.h"
#include "tests/measure/study/common/virtual_run.h"

namespace hapticd::study {

/// A pipeline that only watches: it sees the samples of a run in which no force is rendered. Several watch
/// the same motion, so what differs is theirs.
class Shadow {
 public:
  Shadow(const hal::RigInfo& rig, const rt::SceneSpec& scene, const rt::ObjectModel& model);

  void watch(const hal::RigSample& sample);
  const rt::TickRecord& record() const { return record_; }

 private:
  std::unique_ptr<rt::Pipeline> pipeline_;
  rt::TickRecord record_;
};

/// A run in which nothing is rendered, for shadows to watch.
VirtualRun unrendered(const sim::SimulationConfig& rig);

}  // namespace hapticd::study
