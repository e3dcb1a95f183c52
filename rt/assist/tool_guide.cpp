#include "rt/assist/tool_guide.h"

#include <algorithm>
#include <cmath>

#include "rt/signal/vector.h"

namespace hapticd::rt {

namespace {

/// The greatest speed of a minimum-jerk path of length and duration 1.
constexpr double kPeakOfMinimumJerk = 1.875;
/// How quickly a reference that ends comes to rest.
constexpr double kRestS = 0.015;

/// Share of the way at a share of the time.
double minimum_jerk(double t) noexcept {
  return t * t * t * (10.0 + t * (-15.0 + 6.0 * t));
}

double minimum_jerk_speed(double t) noexcept {
  return 30.0 * t * t * (1.0 - t) * (1.0 - t);
}

}  // namespace

void ToolGuide::begin(const GuideMotion& motion) noexcept {
  motion_ = motion;
  state_ = GuideState::kUnderWay;
  ++number_;
  is_started_ = false;
}

void ToolGuide::cancel() noexcept {
  if (state_ == GuideState::kUnderWay) end(GuideState::kCancelled);
}

void ToolGuide::end(GuideState state) noexcept {
  state_ = state;
  if (!is_started_) share_ = 0.0;
}

// Starts a motion: what the guide gave in letting go of the last one goes on as the integral's part.
void ToolGuide::start(const Situation& now) noexcept {
  is_started_ = true;
  was_free_ = false;
  from_mm_ = now.tip_mm;
  const hal::Vector3 path_mm = motion_.goal_mm - now.tip_mm;
  length_mm_ = norm(path_mm);
  direction_ = length_mm_ > 0.0 ? path_mm * (1.0 / length_mm_) : hal::Vector3{};
  duration_s_ = std::max(0.2, kPeakOfMinimumJerk * length_mm_ / (kPathSpeed * motion_.max_speed_mm_per_s));
  progress_ = 0.0;
  elapsed_s_ = 0.0;
  near_s_ = 0.0;
  resisted_s_ = 0.0;
  reference_mm_ = now.tip_mm;
  reference_mm_per_s_ = {};
  integral_n_ = force_n_ * share_;
  share_ = 1.0;
}

// The path waits for a tool that lags: at two thirds of the greatest spring force it begins to slow down.
void ToolGuide::advance(const Situation& now) noexcept {
  elapsed_s_ += now.interval_s;
  const double lag = kStiffnessNPerMm * dot(reference_mm_ - now.tip_mm, direction_) / motion_.max_force_n;
  const double pace = std::clamp(3.0 * (1.0 - lag), 0.0, 1.0);
  progress_ = std::min(1.0, progress_ + pace * now.interval_s / duration_s_);
  reference_mm_ = from_mm_ + direction_ * (length_mm_ * minimum_jerk(progress_));
  reference_mm_per_s_ = direction_ * (length_mm_ * minimum_jerk_speed(progress_) * pace / duration_s_);
}

GuideState ToolGuide::judged(const Situation& now) noexcept {
  if (!now.in_contact) was_free_ = true;
  if (now.in_contact && was_free_) return GuideState::kContact;
  const bool is_near = progress_ >= 1.0 && norm(motion_.goal_mm - now.tip_mm) <= kArrivedMm;
  near_s_ = is_near ? near_s_ + now.interval_s : 0.0;
  if (near_s_ >= kArrivedS) return GuideState::kArrived;
  const bool is_at_limit = norm(force_n_) >= 0.98 * motion_.max_force_n;
  resisted_s_ = std::max(0.0, resisted_s_ + (is_at_limit ? now.interval_s : -now.interval_s));
  if (resisted_s_ >= kResistedS) return GuideState::kResisted;
  return elapsed_s_ >= motion_.timeout_s ? GuideState::kTimedOut : GuideState::kUnderWay;
}

hal::Vector3 ToolGuide::update(const Situation& now) noexcept {
  if (!now.is_force_allowed) {
    if (state_ == GuideState::kUnderWay) state_ = GuideState::kForceCut;
    share_ = 0.0;
  }
  if (!is_acting()) return {};
  if (state_ == GuideState::kUnderWay) {
    if (!is_started_) start(now);
    advance(now);
    const GuideState judgement = judged(now);
    if (judgement != GuideState::kUnderWay) end(judgement);
  } else {
    share_ = std::max(0.0, share_ - now.interval_s / kLetGoS);
    reference_mm_per_s_ = reference_mm_per_s_ * (kRestS / (kRestS + now.interval_s));
    reference_mm_ = reference_mm_ + reference_mm_per_s_ * now.interval_s;
  }
  const hal::Vector3 spring_n = (reference_mm_ - now.tip_mm) * kStiffnessNPerMm;
  const hal::Vector3 wanted_n =
      spring_n + integral_n_ + (reference_mm_per_s_ - now.velocity_mm_per_s) * kDampingNSPerMm;
  force_n_ = within(wanted_n, motion_.max_force_n);
  const bool is_bounded = exceeds(wanted_n, motion_.max_force_n);
  if (state_ == GuideState::kUnderWay && !is_bounded) {
    integral_n_ = within(integral_n_ + spring_n * (now.interval_s / kIntegralS), 0.5 * motion_.max_force_n);
  }
  return force_n_ * share_;
}

}  // namespace hapticd::rt
