#include "rt/scene/compose.h"

#include "rt/scene/tap_pipeline.h"
#include "rt/scene/wall_pipeline.h"

namespace hapticd::rt {

namespace {
hal::Error lacking(const SceneSpec& spec, const hal::RigInfo& rig, const char* part) {
  return {std::string("the scene needs a ") + part + ", the rig has none", "scene '" + spec.name + "'",
          rig.name, "", "load a scene that does without, or start the daemon on another rig"};
}
}  // namespace

hal::Result<std::unique_ptr<Pipeline>> compose(const SceneSpec& resolved, const hal::RigInfo& rig) {
  if (rig.device.model.empty()) return lacking(resolved, rig, "haptic device");
  if (resolved.object_model != "none") {
    return hal::Error{"model '" + resolved.object_model + "' is not known", "scene '" + resolved.name + "'",
                      "", "object_model = \"none\"",
                      "one-dimensional scenes work from the measured force alone"};
  }
  switch (resolved.kind) {
    case SceneKind::kTap1d:
      if (rig.sensor.model.empty()) return lacking(resolved, rig, "force sensor");
      return std::unique_ptr<Pipeline>(std::make_unique<TapPipeline>(resolved, rig));
    case SceneKind::kWall:
      return std::unique_ptr<Pipeline>(std::make_unique<WallPipeline>(resolved, rig));
  }
  return hal::Error{"unknown kind of scene", "scene '" + resolved.name + "'", "", "", ""};
}

}  // namespace hapticd::rt
