#include "server/identification/estimate/contact/press_frame.h"

#include <cmath>

#include "rt/signal/vector.h"

namespace hapticd::identification {

namespace {

/// Shortest rotation that takes the unit vector `from` to the unit vector `to`.
hal::Quaternion between(const hal::Vector3& from, const hal::Vector3& to) noexcept {
  const hal::Vector3 axis = rt::cross(from, to);
  const hal::Quaternion q{1.0 + dot(from, to), axis.x, axis.y, axis.z};
  if (q.w > 1e-9) return rt::unit(q);
  // Opposite: half a turn about any axis across.
  const hal::Vector3 any = std::abs(from.x) < 0.9 ? hal::Vector3{1.0, 0.0, 0.0} : hal::Vector3{0.0, 1.0, 0.0};
  const hal::Vector3 across_it = rt::direction_or(rt::cross(from, any), {0.0, 1.0, 0.0});
  return {0.0, across_it.x, across_it.y, across_it.z};
}

hal::Quaternion to_press_frame(const PressGeometry& geometry) noexcept {
  const hal::Vector3 down{0.0, 0.0, -1.0};
  const hal::Vector3 press = rt::direction_or(geometry.press_direction, down);
  const hal::Quaternion upright = between(press, down);
  const hal::Vector3 line =
      rt::direction_or(rt::rotated(upright, rt::across(geometry.line_direction, press)), {1.0, 0.0, 0.0});
  // Both lie in the plane across z: a turn about z, half a turn for opposite ones.
  const double half_rad = -0.5 * std::atan2(line.y, line.x);
  return rt::unit(rt::product({std::cos(half_rad), 0.0, 0.0, std::sin(half_rad)}, upright));
}

/// Parameters with which scenes detect contact in three dimensions.
rt::ContactParameters contact_parameters() noexcept {
  rt::ContactParameters parameters;
  parameters.threshold_n = 0.02;
  return parameters;
}

/// The tip has drawn back so far from where the last contact began: whatever was touched, it is not now.
constexpr double kClearMm = 3.0;
/// Factor by which this is faster than in a scene. Presses and strokes leave little time between them, and
/// none builds up as slowly as what a scene has to distinguish from a drift.
constexpr double kFollowsFaster = 4.0;

bool is_fit(const hal::RigSample& sample) noexcept {
  using namespace hal::sample_status;
  constexpr std::uint32_t kUnfit =
      kForceMissing | kForceSaturated | kForceFault | kForceLost | kDeviceFault | kDeviceNotReady;
  const hal::Vector3 sum = sample.tip_position_mm + sample.sensor_force_n;
  return (sample.status & kUnfit) == 0 && std::isfinite(sum.x + sum.y + sum.z);
}

}  // namespace

bool is_usable(const PressGeometry& geometry) noexcept {
  constexpr double kMinSine = 0.17;
  const double press = rt::norm(geometry.press_direction);
  const double line = rt::norm(geometry.line_direction);
  return std::isfinite(press) && std::isfinite(line) && press > 1e-6 && line > 1e-6 &&
         rt::norm(rt::cross(geometry.press_direction, geometry.line_direction)) > kMinSine * press * line;
}

PressFrame::PressFrame(const PressGeometry& geometry, const rt::ToolLoad& load, double tool_mass_g,
                       const hal::RigInfo& rig)
    : load_(load),
      weight_n_{0.0, 0.0, -rt::inertial_force_n(tool_mass_g, rt::ToolLoad::kGravityMmPerS2)},
      press_(rt::direction_or(geometry.press_direction, {0.0, 0.0, -1.0})),
      to_press_(to_press_frame(geometry)),
      zero_(rt::ContactParameters{}.zero_bound_n),
      timer_(rig.rate_hz),
      contact_(contact_parameters(), tool_mass_g, rig.rate_hz) {}

void PressFrame::follow_zero(const hal::RigSample& sample) noexcept {
  if (!is_fit(sample)) return;
  if (zero_.take_bias(sample.bias_serial)) contact_.await_free();
  const std::int64_t position_ns = sample.time_ns - sample.position_age_ns;
  rt::ContactStage3::Input input;
  input.interval = timer_.update(position_ns);
  const hal::Vector3 load_n =
      load_.without_weight_n(sample.sensor_force_n - zero_.force_n(), sample.tip_orientation);
  input.free_motion = {load_n * -1.0, sample.tip_position_mm, position_ns,
                       sample.time_ns - sample.force_mean_age_ns};
  input.tip_mm = sample.tip_position_mm;
  input.reaction_n = rt::norm(load_n);
  input.depth_mm = dot(sample.tip_position_mm, press_);
  input.contact_depth_mm = contact_depth_mm_;
  contact_.detect(input);
  if (contact_.detector().just_declared()) {
    contact_depth_mm_ = dot(contact_.onset_mm(), press_);
    has_touched_ = true;
  }
  // A reading that drifted beyond the threshold during a contact would count as a contact for ever after.
  const bool is_clear = has_touched_ && !contact_.in_contact() &&
                        input.depth_mm < contact_depth_mm_ - kClearMm &&
                        contact_.force_n() < rt::ZeroTracker::kMaxErrorN;
  if (!contact_.zero_shows() && !is_clear) return;
  rt::TickInterval interval = input.interval;
  interval.s *= kFollowsFaster;
  zero_.update({load_.in_sensor_frame(contact_.residual_n() * -1.0, sample.tip_orientation),
                sample.sensor_torque_n_mm - zero_.torque_n_mm()},
               rt::ZeroTracker::kRestMmPerS, interval);  // it moves most of the time: no rate is learnt
}

rt::Observation PressFrame::upright(const rt::Observation& observation) const noexcept {
  rt::Observation out = observation;
  const hal::RigSample& in = observation.sample;
  out.sample.tip_position_mm = turned(in.tip_position_mm);
  out.sample.tip_orientation = {};
  out.sample.sensor_force_n =
      turned(load_.without_weight_n(in.sensor_force_n - zero_.force_n(), in.tip_orientation));
  out.sample.sensor_torque_n_mm = turned(load_.in_rig_frame(in.sensor_torque_n_mm, in.tip_orientation));
  out.device_command_n = turned(observation.device_command_n);
  out.external_position_mm = turned(observation.external_position_mm);
  return out;
}

rt::Observation PressFrame::seated(const rt::Observation& observation) const noexcept {
  rt::Observation out = observation;
  const hal::RigSample& in = observation.sample;
  const hal::Vector3 with_weight_n =
      load_.without_weight_n(in.sensor_force_n - zero_.force_n(), in.tip_orientation) + weight_n_;
  out.sample.sensor_force_n =
      rt::rotated(rt::conjugate(rt::unit(in.tip_orientation)), with_weight_n) - weight_n_;
  return out;
}

}  // namespace hapticd::identification
