#include "server/identification/gate/sample_policy.h"

#include <algorithm>

namespace hapticd::identification {

namespace {

namespace status = hal::sample_status;

constexpr double kUnknown = std::numeric_limits<double>::infinity();

constexpr std::uint32_t bit(Unfit reason) noexcept {
  return 1U << static_cast<unsigned>(reason);
}
/// Status bits that last, as a fault does. A force missing from one tick is part of the next mean.
constexpr std::uint32_t kInterrupting =
    bit(Unfit::kSaturated) | bit(Unfit::kFault) | bit(Unfit::kNotANumber) | bit(Unfit::kStale);

double period_s(const hal::RigInfo& rig) noexcept {
  return rig.rate_hz > 0.0 ? 1.0 / rig.rate_hz : 1e-3;
}
double three_periods_s(const hal::RigInfo& rig) noexcept {
  return std::max(kMaxSampleStepS, 3.0 / (rig.rate_hz > 0.0 ? rig.rate_hz : 1000.0));
}
double end_of_range_n(const hal::RigInfo& rig, double share) noexcept {
  return rig.sensor.range_n > 0.0 ? share * rig.sensor.range_n : kUnknown;
}

}  // namespace

SamplePolicy palpation_policy(const hal::RigInfo& rig) noexcept {
  SamplePolicy policy;
  policy.press_axis_only = policy.force = true;
  policy.status =
      status::kForceSaturated | status::kForceMissing | status::kForceFault | status::kDeviceFault;
  policy.end_of_range_n = end_of_range_n(rig, 0.999);  // of one axis
  policy.clip = {.run = 4, .moved_share_of_range = 0.005, .refuses = true};
  policy.max_step_s = 5.0 * period_s(rig);
  policy.order = {Unfit::kNotANumber, Unfit::kNoForce, Unfit::kFault, Unfit::kSaturated, Unfit::kStale};
  return policy;
}

SamplePolicy scan_policy(const hal::RigInfo& rig) noexcept {
  SamplePolicy policy = threshold_policy();
  policy.end_of_range_n = end_of_range_n(rig, 0.995);  // of the norm
  policy.max_force_age_ns = 20'000'000;
  policy.max_step_s = std::max(5.0 * period_s(rig), kMaxSampleStepS);
  return policy;
}

SamplePolicy stroke_policy(const hal::RigInfo& rig) noexcept {
  SamplePolicy policy;
  policy.force = policy.orientation = true;
  policy.status = ~0U;
  policy.end_of_range_n = end_of_range_n(rig, 0.995);  // of the norm
  // The force of a perfectly even sliding repeats as well.
  policy.clip = {.run = 25, .moved_mm = 0.01, .refuses = false};
  policy.max_step_s = std::max(5.0 * period_s(rig), kMaxSampleStepS);
  return policy;
}

SamplePolicy tool_policy(const hal::RigInfo& rig) noexcept {
  SamplePolicy policy = threshold_policy();
  policy.torque = true;
  policy.min_orientation_norm_squared = 0.25;
  policy.max_force_age_ns = 20'000'000;
  policy.max_step_s = three_periods_s(rig);
  policy.order = SamplePolicy{}.order;
  return policy;
}

SamplePolicy threshold_policy() noexcept {
  SamplePolicy policy;
  policy.force = policy.orientation = true;
  policy.max_position_mm = 1e5;
  policy.max_force_n = 1e4;
  policy.status = status::kForceSaturated | status::kForceMissing | status::kForceFault | status::kForceLost |
                  status::kDeviceFault;
  policy.order = {Unfit::kFault, Unfit::kNoForce, Unfit::kSaturated, Unfit::kNotANumber, Unfit::kStale};
  policy.interrupting = kInterrupting;
  return policy;
}

SamplePolicy gains_policy() noexcept {
  SamplePolicy policy;
  policy.force = policy.command = true;
  policy.status =
      status::kForceSaturated | status::kForceMissing | status::kForceFault | status::kDeviceFault;
  return policy;
}

SamplePolicy structural_policy(const hal::RigInfo& rig, bool rigid_contact) noexcept {
  SamplePolicy policy;
  policy.force = rigid_contact;
  policy.command = true;
  policy.status = status::kDeviceFault;
  policy.max_step_s = three_periods_s(rig);
  policy.interrupting = kInterrupting;
  return policy;
}

}  // namespace hapticd::identification
