#include "server/config/guard_ceilings.h"

#include <fmt/format.h>

#include <algorithm>

#include "rt/target/largest_target.h"
#include "server/text/range.h"

namespace hapticd::server {

namespace {

constexpr double kFullScaleTimeS = 0.005;  // as rt::resolve(): from zero to full force

/// One value of a scene and the daemon's limit of it.
struct Bound {
  const char* scene_key;
  const char* daemon_key;  ///< of [guard]
  const char* unit;
  double* value;
  double limit;
  bool is_floor;     ///< `limit` is the minimum, else the maximum
  bool zero_is_off;  ///< zero would switch the check off: refused, too
  double not_said;   ///< the value of a scene that says nothing
  double then;       ///< what such a scene gets without the ceilings; 0 = `not_said`
};

bool uses_sensor(const rt::SceneSpec& scene) {
  return scene.kind != rt::SceneKind::kWall;
}

std::vector<Bound> bounds_on(const GuardCeilings& c, const hal::DeviceInfo& device, rt::SceneSpec& scene) {
  const rt::SceneSpec plain;
  const rt::GuardLimits& usual = plain.guard;
  const bool is_wall = scene.kind == rt::SceneKind::kWall;
  const double largest =
      is_wall ? rt::default_largest_wall_n_per_mm(device.model) : rt::largest_target_n_per_mm(device);
  rt::GuardLimits& guard = scene.guard;
  const double force_n = guard.max_force_n > 0.0 ? guard.max_force_n : c.max_force_n;
  std::vector<Bound> bounds = {
      {"guard.max_force_n", "max_force_n", "N", &guard.max_force_n, c.max_force_n, false, false, 0.0,
       device.max_force_n},
      {"guard.max_force_rate_n_per_s", "max_force_rate_n_per_s", "N/s", &guard.max_force_rate_n_per_s,
       c.max_force_rate_n_per_s, false, false, 0.0, force_n / kFullScaleTimeS},
      {"guard.max_power_w", "max_power_w", "W", &guard.max_power_w, c.max_power_w, false, false,
       usual.max_power_w, usual.max_power_w},
      {"target.max_stiffness_n_per_mm",
       is_wall ? "max_wall_stiffness_n_per_mm" : "max_target_stiffness_n_per_mm", "N/mm",
       &scene.max_target_stiffness_n_per_mm,
       is_wall ? c.max_wall_stiffness_n_per_mm : c.max_target_stiffness_n_per_mm, false, false, 0.0, largest},
      {"target.ramp_s", "min_target_ramp_s", "s", &scene.target_ramp_s, c.min_target_ramp_s, true, false,
       plain.target_ramp_s, plain.target_ramp_s},
      {"target.max_change_n_per_s", "max_target_change_n_per_s", "N/s", &scene.max_target_change_n_per_s,
       c.max_target_change_n_per_s, false, false, plain.max_target_change_n_per_s,
       plain.max_target_change_n_per_s},
      {"guard.resume_ramp_s", "min_resume_ramp_s", "s", &guard.resume_ramp_s, c.min_resume_ramp_s, true,
       false, usual.resume_ramp_s, usual.resume_ramp_s},
      {"guard.fall_ramp_s", "max_fall_ramp_s", "s", &guard.fall_ramp_s, c.max_fall_ramp_s, false, false,
       usual.fall_ramp_s, usual.fall_ramp_s},
      {"guard.loop_gap_ms", "max_loop_gap_ms", "ms", &guard.loop_gap_ms, c.max_loop_gap_ms, false, true,
       usual.loop_gap_ms, usual.loop_gap_ms},
  };
  if (uses_sensor(scene)) {
    bounds.push_back({"guard.sensor_stale_after_ms", "max_sensor_stale_after_ms", "ms",
                      &guard.sensor_stale_after_ms, c.max_sensor_stale_after_ms, false, true,
                      usual.sensor_stale_after_ms, usual.sensor_stale_after_ms});
  }
  return bounds;
}

bool breaks(const Bound& bound) {
  constexpr double kRounding = 1e-9;
  if (bound.zero_is_off && !(*bound.value > 0.0)) return true;
  return bound.is_floor ? !(*bound.value >= bound.limit * (1.0 - kRounding))
                        : !(*bound.value <= bound.limit * (1.0 + kRounding));
}

}  // namespace

GuardCeilings on_device(const GuardCeilings& ceilings, const hal::DeviceInfo& device) {
  GuardCeilings c = ceilings;
  if (c.max_force_n == 0.0) c.max_force_n = device.max_force_n;
  if (c.max_force_rate_n_per_s == 0.0) c.max_force_rate_n_per_s = device.max_force_n / kFullScaleTimeS;
  if (c.max_target_stiffness_n_per_mm == 0.0) {
    c.max_target_stiffness_n_per_mm = rt::largest_target_n_per_mm(device);
  }
  if (c.max_wall_stiffness_n_per_mm == 0.0) {
    c.max_wall_stiffness_n_per_mm = rt::default_largest_wall_n_per_mm(device.model);
  }
  return c;
}

void fill_from_ceilings(const GuardCeilings& ceilings, const hal::DeviceInfo& device, rt::SceneSpec& scene,
                        std::vector<std::string>& remarks) {
  for (const Bound& bound : bounds_on(on_device(ceilings, device), device, scene)) {
    if (*bound.value != bound.not_said) continue;
    const bool keeps = bound.is_floor ? bound.then >= bound.limit : bound.then <= bound.limit;
    if (keeps) continue;
    *bound.value = bound.limit;
    remarks.push_back(fmt::format("{} = {}: [guard] {} of the daemon's configuration", bound.scene_key,
                                  to_text(bound.limit, bound.unit), bound.daemon_key));
  }
}

std::optional<hal::Error> check_ceilings(const GuardCeilings& ceilings, const hal::DeviceInfo& device,
                                         const rt::SceneSpec& resolved) {
  rt::SceneSpec scene = resolved;
  for (const Bound& bound : bounds_on(on_device(ceilings, device), device, scene)) {
    if (!breaks(bound)) continue;
    const bool is_off = bound.zero_is_off && !(*bound.value > 0.0);
    const char* complaint = is_off           ? "a check of the guard may not be switched off"
                            : bound.is_floor ? "less than this daemon allows"
                                             : "more than this daemon allows";
    return hal::Error::of(
        hal::ErrorCode::kOutOfRange, complaint, fmt::format("scene '{}', {}", resolved.name, bound.scene_key),
        to_text(*bound.value, bound.unit),
        fmt::format("{} {} ([guard] {})", bound.is_floor ? "at least" : "at most",
                    to_text(bound.limit, bound.unit), bound.daemon_key),
        fmt::format("change the scene, or {} {} under [guard] in the daemon's configuration and start it "
                    "again",
                    bound.is_floor ? "lower" : "raise", bound.daemon_key));
  }
  return std::nullopt;
}

rt::GuardLimits within_ceilings(const GuardCeilings& ceilings, const hal::DeviceInfo& device,
                                rt::GuardLimits limits) {
  const GuardCeilings c = on_device(ceilings, device);
  limits.max_force_n = std::min(limits.max_force_n, c.max_force_n);
  limits.max_force_rate_n_per_s = std::min(limits.max_force_rate_n_per_s, c.max_force_rate_n_per_s);
  limits.max_power_w = std::min(limits.max_power_w, c.max_power_w);
  limits.loop_gap_ms = std::min(limits.loop_gap_ms, c.max_loop_gap_ms);
  limits.resume_ramp_s = std::max(limits.resume_ramp_s, c.min_resume_ramp_s);
  limits.fall_ramp_s = std::min(limits.fall_ramp_s, c.max_fall_ramp_s);
  return limits;
}

}  // namespace hapticd::server
