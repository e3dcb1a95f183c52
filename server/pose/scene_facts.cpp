#include "server/pose/scene_facts.h"

namespace hapticd::pose {

SceneFacts facts_of(const server::ResolvedScene* scene, const hal::DeviceInfo& device) {
  SceneFacts facts;
  if (scene == nullptr) return facts;
  if (scene->spec.kind != rt::SceneKind::kExplore) facts.press_axis = scene->spec.press_axis;
  const double of_scene = scene->spec.structural_stiffness_n_per_mm;
  facts.structural_stiffness_n_per_mm = of_scene > 0.0 ? of_scene : device.structural_stiffness_n_per_mm;
  return facts;
}

DeviceFrame device_frame_of(const server::DaemonConfig& config) {
  return config.device == server::DeviceChoice::kOpenHaptics ? openhaptics_frame(config.openhaptics.origin_mm)
                                                             : DeviceFrame();
}

}  // namespace hapticd::pose
