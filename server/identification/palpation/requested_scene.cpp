#include "server/identification/palpation/requested_scene.h"

namespace hapticd::server {

std::optional<rt::SceneSpec> requested_scene(const identification::MotionRequest& request,
                                             const hal::RigInfo& rig) {
  if (request.device == identification::MotionRequest::Device::kNothing) return std::nullopt;
  rt::SceneSpec scene;
  scene.name = "identification";
  scene.tool_mass_g = rig.sensor.tool_mass_g;
  scene.target = rt::linear_target(request.stiffness_n_per_mm);
  if (request.device == identification::MotionRequest::Device::kWall) {
    scene.kind = rt::SceneKind::kWall;
    scene.wall_position_mm = -request.place_mm.z;
    scene.structural_compensation = false;  // the encoders are to see the plain wall of (4.26)
  } else {
    if (request.proportional_gain > 0.0) {
      scene.controller.proportional_gain = request.proportional_gain;
      scene.controller.derivative_gain_ms = request.derivative_ms;
      scene.seeks_ultimate_gain = true;
    }
    scene.structural_compensation = !request.encoders_as_they_are;
    scene.guard.max_force_n = request.max_device_force_n;
  }
  return scene;
}

bool renders_the_same(const rt::SceneSpec& a, const rt::SceneSpec& b) {
  return a.kind == b.kind && a.target.stiffness_n_per_mm == b.target.stiffness_n_per_mm &&
         a.wall_position_mm == b.wall_position_mm &&
         a.controller.proportional_gain == b.controller.proportional_gain &&
         a.controller.derivative_gain_ms == b.controller.derivative_gain_ms &&
         a.structural_compensation == b.structural_compensation && a.guard.max_force_n == b.guard.max_force_n;
}

}  // namespace hapticd::server
