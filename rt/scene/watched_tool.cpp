#include "rt/scene/watched_tool.h"

#include <cmath>

#include "rt/signal/tool_compensation.h"

namespace hapticd::rt {

LoadMonitorParameters watched_tool(const SceneSpec& spec, const hal::RigInfo& rig) noexcept {
  LoadMonitorParameters tool;
  const double known_g = rig.sensor.tool_mass_g;
  const double stiffness_n_per_mm = rig.device.structural_stiffness_n_per_mm;
  if (stiffness_n_per_mm > 0.0) tool.compliance_mm_per_n = 1.0 / stiffness_n_per_mm;
  // A scene may be wrong about it, or right although another tool was mounted: what either explains is not a
  // load.
  tool.tool_mass_g = known_g > 0.0 ? known_g : spec.tool_mass_g;
  if (spec.tool_mass_g > 0.0) tool.mass_error_g = std::abs(spec.tool_mass_g - tool.tool_mass_g);
  if (spec.kind != SceneKind::kExplore) return tool;
  tool.knows_weight_in_zero = true;
  if (const auto& mounting = spec.explore.sensor_mounting) {
    tool.sensor_to_tool = mounting->to_tool();
    tool.weight_in_zero_n = mounting->force_bias_n * -1.0;
  } else {
    tool.weight_in_zero_n =
        spec.explore.gravity_at_bias * inertial_force_n(tool.tool_mass_g, ToolLoad::kGravityMmPerS2);
  }
  return tool;
}

}  // namespace hapticd::rt
