#include "rt/contact/free_motion_residual.h"

#include <algorithm>
#include <cmath>

#include "rt/signal/tool_compensation.h"

namespace hapticd::rt {

FreeMotionResidual::FreeMotionResidual(double tool_mass_g, double rate_hz) noexcept
    : tool_mass_g_(tool_mass_g),
      rate_hz_(rate_hz),
      delay_s_(2.0 * ButterworthLowPass::low_frequency_delay_s(kCutoffHz)),
      unseen_n_(delay_s_ * inertial_force_n(tool_mass_g, kUnseenJerkMmPerS3)),
      jerk_decay_(std::exp(-1.0 / (kJerkMemoryS * rate_hz))),
      residual_1_(kCutoffHz, rate_hz),
      residual_2_(kCutoffHz, rate_hz),
      force_1_(kCutoffHz, rate_hz),
      force_2_(kCutoffHz, rate_hz),
      inertia_1_(kCutoffHz, rate_hz),
      inertia_2_(kCutoffHz, rate_hz) {}

double FreeMotionResidual::update(double sensor_force_n, double depth_mm, std::int64_t time_ns,
                                  bool in_contact) noexcept {
  const double step_s = static_cast<double>(time_ns - last_time_ns_) * 1e-9;
  constexpr double kLongestStepS = 0.016;
  if (samples_ == 0 || !(step_s > 0.0) || step_s > kLongestStepS) {
    for (ButterworthLowPass* filter : {&residual_1_, &residual_2_, &force_1_, &force_2_})
      filter->seed(sensor_force_n);
    for (ButterworthLowPass* filter : {&inertia_1_, &inertia_2_}) filter->seed(0.0);
    samples_ = 1;
    last_velocity_mm_per_s_ = 0.0;
    last_inertia_n_ = 0.0;
    jerk_n_per_s_ = 0.0;
    residual_n_ = sensor_force_n;
  } else if (step_s * rate_hz_ < 0.25) {
    return residual_n_;  // two reads almost at once: no motion can be told from them
  } else {
    const double velocity = (depth_mm - last_depth_mm_) / step_s;
    // The first velocity has no predecessor to differ from.
    const double acceleration =
        samples_ < 2 ? 0.0 : 2.0 * (velocity - last_velocity_mm_per_s_) / (step_s + last_step_s_);
    const double raw_inertia_n = inertial_force_n(tool_mass_g_, acceleration);
    // The second difference is centred one tick back; so is the mean of two forces.
    const double aligned_force_n = 0.5 * (sensor_force_n + last_force_n_);
    const double matched = residual_2_.update(residual_1_.update(aligned_force_n - raw_inertia_n));
    const double lead = sensor_force_n - force_2_.update(force_1_.update(sensor_force_n));

    const double inertia_n = inertia_2_.update(inertia_1_.update(raw_inertia_n));
    const double jerk_now = in_contact ? 0.0 : std::abs(inertia_n - last_inertia_n_) / step_s;
    jerk_n_per_s_ = std::max(jerk_decay_ * jerk_n_per_s_, jerk_now);
    last_inertia_n_ = inertia_n;
    seen_jerk_n_ = kJerkMargin * delay_s_ * jerk_n_per_s_;
    residual_n_ = matched + std::copysign(std::max(0.0, std::abs(lead) - explained_by_jerk_n()), lead);

    samples_ = 2;
    last_velocity_mm_per_s_ = velocity;
    last_step_s_ = step_s;
  }
  last_time_ns_ = time_ns;
  last_depth_mm_ = depth_mm;
  last_force_n_ = sensor_force_n;
  return residual_n_;
}

void FreeMotionResidual::assume_free() noexcept {
  for (ButterworthLowPass* filter : {&residual_1_, &residual_2_}) filter->seed(0.0);
  for (ButterworthLowPass* filter : {&force_1_, &force_2_, &inertia_1_, &inertia_2_})
    filter->seed(last_force_n_);
  last_inertia_n_ = last_force_n_;
  residual_n_ = 0.0;
}

}  // namespace hapticd::rt
