#include "rt/contact/free_motion_residual.h"

#include <algorithm>
#include <cmath>

#include "rt/signal/tick_interval.h"
#include "rt/signal/tool_compensation.h"
#include "rt/signal/vector.h"

namespace hapticd::rt {

template <class Value>
BasicFreeMotionResidual<Value>::BasicFreeMotionResidual(double tool_mass_g, double rate_hz) noexcept
    : tool_mass_g_(tool_mass_g),
      rate_hz_(rate_hz),
      delay_s_(2.0 * ButterworthLowPass::low_frequency_delay_s(kCutoffHz)),
      prompt_age_ns_(static_cast<std::int64_t>(0.5e9 * (kPromptMeanS - 1.0 / rate_hz))),
      unseen_jerk_n_per_s_(inertial_force_n(tool_mass_g, kUnseenJerkMmPerS3)),
      unseen_n_(delay_s_ * unseen_jerk_n_per_s_),
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
void BasicFreeMotionResidual<Value>::start(const Measurement& now) noexcept {
  seed({now.force_n, now.force_n, Value{}});
  lead_force_.seed(now.force_n);
  prompt_force_.seed(now.force_n);
  positions_.seed(now.position_ns, now.position_mm);
  forces_.seed(now.force_ns, now.force_n);
  inertias_.seed(now.position_ns, Value{});
  samples_ = 1;
  last_step_s_ = 0.0;
  last_velocity_mm_per_s_ = Value{};
  last_inertia_n_ = Value{};
  jerk_n_per_s_ = seen_jerk_n_ = irregular_n_ = 0.0;
  residual_n_ = now.force_n;
  last_ = now;
}

template <class Value>
void BasicFreeMotionResidual<Value>::step(const Measurement& now, double step_s, bool in_contact) noexcept {
  const Value velocity = (now.position_mm - last_.position_mm) * (1.0 / step_s);
  positions_.push(now.position_ns, now.position_mm);
  forces_.push(now.force_ns, now.force_n);
  if (samples_ == 1) {  // the first velocity has no predecessor to differ from
    last_step_s_ = step_s;
  } else {
    // The second difference stands for the middle of its three positions.
    const auto middle_ns =
        now.position_ns - static_cast<std::int64_t>(1e9 * (2.0 * step_s + last_step_s_) / 3.0);
    const Value acceleration = (velocity - last_velocity_mm_per_s_) * (2.0 / (step_s + last_step_s_));
    inertias_.push(middle_ns, acceleration * inertial_force_n(tool_mass_g_, 1.0));
  }
  const std::int64_t common_ns = std::min(inertias_.newest_ns(), now.force_ns);
  const Value raw_inertia_n = inertias_.at(common_ns);
  // Over the interval before the last: what is filtered is one position back.
  const double passed_s = last_step_s_;
  const double periods = passed_s * rate_hz_;
  const Signals& passed = section_2_.update(
      section_1_.update({forces_.at(common_ns) - raw_inertia_n, now.force_n, raw_inertia_n}, periods),
      periods);
  prompt_force_.update(now.force_n);
  const Value lead = lead_force_.update(now.force_n) - passed.force_n();

  const double jerk_now = in_contact ? 0.0 : magnitude(passed.inertia_n() - last_inertia_n_) / passed_s;
  jerk_n_per_s_ = std::max(jerk_n_per_s_ / (1.0 + step_s / kJerkMemoryS), jerk_now);
  last_inertia_n_ = passed.inertia_n();
  seen_jerk_n_ = kJerkMargin * delay_s_ * jerk_n_per_s_;
  if (irregular_n_ > 0.0) irregular_n_ /= 1.0 + step_s / delay_s_;
  residual_n_ = passed.residual_n() + shortened(lead, explained_by_jerk_n());

  samples_ = 2;
  last_velocity_mm_per_s_ = velocity;
  last_step_s_ = step_s;
  last_ = now;
}

template <class Value>
void BasicFreeMotionResidual<Value>::fill(const Measurement& now, double step_s, bool in_contact) noexcept {
  const auto steps = static_cast<int>(std::lround(step_s * rate_hz_));
  // A parabola through where the tip was a little before the interval, at its start and at its end; the force
  // is the mean over it throughout.
  const Measurement from = last_;
  const auto before_ns = from.position_ns - static_cast<std::int64_t>(1e9 * kBeforeS);
  const double before_s = std::max(
      1e-9 * static_cast<double>(from.position_ns - std::max(before_ns, positions_.oldest_ns())), 0.0);
  const Value mean = (now.position_mm - from.position_mm) * (1.0 / step_s);
  const Value bend = before_s > 0.5 * kBeforeS
                         ? (mean - (from.position_mm - positions_.at(before_ns)) * (1.0 / before_s)) *
                               (2.0 / (step_s + before_s))
                         : Value{};
  // Each step has its own share of a mean over all of it, so much younger.
  const std::int64_t interval_ns = now.position_ns - from.position_ns;
  const std::int64_t force_age_ns =
      std::max<std::int64_t>(0, now.position_ns - now.force_ns - (interval_ns - interval_ns / steps) / 2);
  for (int i = 1; i <= steps; ++i) {
    const std::int64_t since_ns = interval_ns * i / steps;
    const double t = 1e-9 * static_cast<double>(since_ns);
    Measurement between = now;
    between.position_mm = from.position_mm + mean * t - bend * (0.5 * t * (step_s - t));
    between.position_ns = from.position_ns + since_ns;
    between.force_ns = std::max(between.position_ns - force_age_ns, forces_.newest_ns() + 1);
    step(between, 1e-9 * static_cast<double>(between.position_ns - last_.position_ns), in_contact);
  }
  const double excess_s = step_s - 1.0 / rate_hz_;
  irregular_n_ = std::max(irregular_n_, 0.5 * (jerk_n_per_s_ + unseen_jerk_n_per_s_) * excess_s *
                                            std::min(1.0, step_s / delay_s_));
}

template <class Value>
Value BasicFreeMotionResidual<Value>::update(const Measurement& now, bool in_contact) noexcept {
  const double step_s = static_cast<double>(now.position_ns - last_.position_ns) * 1e-9;
  if (samples_ == 0 || !(step_s >= 0.0) || step_s > TickInterval::kMaxFollowedS) [[unlikely]] {
    start(now);
  } else if (step_s * rate_hz_ < 0.25 || now.force_ns <= forces_.newest_ns()) {
    return residual_n_;  // no motion shows in two reads almost at once; an old force does not count as a new
                         // one
  } else if (step_s * rate_hz_ >= 1.5) [[unlikely]] {
    fill(now, step_s, in_contact);
  } else {
    step(now, step_s, in_contact);
  }
  return residual_n_;
}

template <class Value>
Value BasicFreeMotionResidual<Value>::update(const Value& sensor_force_n, const Value& position_mm,
                                             std::int64_t time_ns, bool in_contact) noexcept {
  const std::int64_t since_last_ns = samples_ == 0 ? 0 : time_ns - last_.position_ns;
  return update({sensor_force_n, position_mm, time_ns, time_ns - since_last_ns / 2}, in_contact);
}

template <class Value>
void BasicFreeMotionResidual<Value>::assume_free() noexcept {
  const Value force_n = prompt_force_.mean();
  seed({Value{}, force_n, force_n});
  inertias_.seed(last_.position_ns, force_n);
  last_inertia_n_ = force_n;
  residual_n_ = Value{};
}

template <class Value>
void BasicFreeMotionResidual<Value>::start_free() noexcept {
  lead_force_.seed(last_.force_n);
  prompt_force_.seed(last_.force_n);
  assume_free();
}

template class BasicFreeMotionResidual<double>;
template class BasicFreeMotionResidual<hal::Vector3>;

}  // namespace hapticd::rt
