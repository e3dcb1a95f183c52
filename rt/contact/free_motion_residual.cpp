#include "rt/contact/free_motion_residual.h"

#include <algorithm>
#include <cmath>

#include "rt/signal/tool_compensation.h"
#include "rt/signal/vector.h"

namespace hapticd::rt {

template <class Value>
BasicFreeMotionResidual<Value>::BasicFreeMotionResidual(double tool_mass_g, double rate_hz) noexcept
    : tool_mass_g_(tool_mass_g),
      rate_hz_(rate_hz),
      delay_s_(2.0 * ButterworthLowPass::low_frequency_delay_s(kCutoffHz)),
      unseen_n_(delay_s_ * inertial_force_n(tool_mass_g, kUnseenJerkMmPerS3)),
      jerk_decay_(std::exp(-1.0 / (kJerkMemoryS * rate_hz))),
      lead_force_(kLeadMeanS, rate_hz),
      prompt_force_(kPromptMeanS, rate_hz),
      section_1_(kCutoffHz, rate_hz),
      section_2_(kCutoffHz, rate_hz) {}

template <class Value>
void BasicFreeMotionResidual<Value>::seed(const Signals& signals) noexcept {
  section_1_.seed(signals);
  section_2_.seed(signals);
}

template <class Value>
Value BasicFreeMotionResidual<Value>::update(const Value& sensor_force_n, const Value& position_mm,
                                             std::int64_t time_ns, bool in_contact) noexcept {
  const double step_s = static_cast<double>(time_ns - last_time_ns_) * 1e-9;
  constexpr double kLongestStepS = 0.016;
  if (samples_ == 0 || !(step_s > 0.0) || step_s > kLongestStepS) [[unlikely]] {
    seed({sensor_force_n, sensor_force_n, Value{}});
    lead_force_.seed(sensor_force_n);
    prompt_force_.seed(sensor_force_n);
    samples_ = 1;
    last_velocity_mm_per_s_ = Value{};
    last_inertia_n_ = Value{};
    jerk_n_per_s_ = 0.0;
    residual_n_ = sensor_force_n;
  } else if (step_s * rate_hz_ < 0.25) {
    return residual_n_;  // two reads almost at once: no motion can be told from them
  } else {
    const Value velocity = (position_mm - last_position_mm_) * (1.0 / step_s);
    // The first velocity has no predecessor to differ from.
    const Value acceleration =
        samples_ < 2 ? Value{} : (velocity - last_velocity_mm_per_s_) * (2.0 / (step_s + last_step_s_));
    const Value raw_inertia_n = acceleration * inertial_force_n(tool_mass_g_, 1.0);
    // The second difference is centred one tick back; so is the mean of two forces.
    const Value aligned_force_n = (sensor_force_n + last_force_n_) * 0.5;
    const Signals passed = section_2_.update(
        section_1_.update({aligned_force_n - raw_inertia_n, sensor_force_n, raw_inertia_n}));
    prompt_force_.update(sensor_force_n);
    const Value lead = lead_force_.update(sensor_force_n) - passed.force_n;

    const double jerk_now = in_contact ? 0.0 : magnitude(passed.inertia_n - last_inertia_n_) / step_s;
    jerk_n_per_s_ = std::max(jerk_decay_ * jerk_n_per_s_, jerk_now);
    last_inertia_n_ = passed.inertia_n;
    seen_jerk_n_ = kJerkMargin * delay_s_ * jerk_n_per_s_;
    residual_n_ = passed.residual_n + shortened(lead, explained_by_jerk_n());

    samples_ = 2;
    last_velocity_mm_per_s_ = velocity;
    last_step_s_ = step_s;
  }
  last_time_ns_ = time_ns;
  last_position_mm_ = position_mm;
  last_force_n_ = sensor_force_n;
  return residual_n_;
}

template <class Value>
void BasicFreeMotionResidual<Value>::assume_free() noexcept {
  const Value force_n = prompt_force_.mean();
  seed({Value{}, force_n, force_n});
  last_inertia_n_ = force_n;
  residual_n_ = Value{};
}

template class BasicFreeMotionResidual<double>;
template class BasicFreeMotionResidual<hal::Vector3>;

}  // namespace hapticd::rt
