#include "server/palpation/wished_scene.h"

namespace hapticd::server {

std::optional<rt::SceneSpec> wished_scene(const rt::Wish& wish, const hal::RigInfo& rig) {
  if (wish.device == rt::Wish::Device::kNothing) return std::nullopt;
  rt::SceneSpec scene;
  scene.name = "identification";
  scene.tool_mass_g = rig.sensor.tool_mass_g;
  scene.target = rt::linear_target(wish.stiffness_n_per_mm);
  if (wish.device == rt::Wish::Device::kWall) {
    scene.kind = rt::SceneKind::kWall;
    scene.wall_position_mm = -wish.place_mm.z;
    scene.structural_compensation = false;  // the encoders are to see the plain wall of (4.26)
  } else {
    if (wish.proportional_gain > 0.0) {
      scene.controller.proportional_gain = wish.proportional_gain;
      scene.controller.derivative_gain_ms = wish.derivative_ms;
    }
    scene.structural_compensation = !wish.encoders_as_they_are;
    scene.guard.max_force_n = wish.max_device_force_n;
  }
  return scene;
}

}  // namespace hapticd::server
