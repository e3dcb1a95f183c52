#include "rt/signal/adaptive_window_velocity.h"

#include <algorithm>
#include <cmath>

#include "rt/signal/ticks.h"

namespace hapticd::rt {
AdaptiveWindowVelocity::AdaptiveWindowVelocity(double noise_bound_mm, double rate_hz, Fit fit) noexcept
    : noise_bound_mm_(noise_bound_mm),
      rate_hz_(rate_hz),
      spacing_(std::min(static_cast<int>(ticks_of(kSpacingS, rate_hz)), kWidestSpacing)),
      held_(kMaxWindow * spacing_ + 1),
      fit_(fit),
      newest_(held_) {}

void AdaptiveWindowVelocity::reset() noexcept {
  filled_ = 0;
  points_ = 0;
  window_ = 0;
  velocity_mm_per_s_ = 0.0;
}

double AdaptiveWindowVelocity::update(double position_mm, double periods) noexcept {
  const Reading now{position_mm, filled_ == 0 ? 0.0 : reading(0).periods + periods};
  newest_ = newest_ + 1 < 2 * held_ ? newest_ + 1 : held_;
  readings_[static_cast<std::size_t>(newest_)] = now;
  readings_[static_cast<std::size_t>(newest_ - held_)] = now;
  if (filled_ < held_) [[unlikely]]
    points_ = filled_++ / spacing_;
  if (points_ == 0) [[unlikely]] {
    fit_first();
  } else {
    fit_ == Fit::kEnd ? fit_end() : fit_best();
    window_ *= spacing_;
  }
  return velocity_mm_per_s_;
}

// Less than a point's spacing after the start: the line from the first position.
void AdaptiveWindowVelocity::fit_first() noexcept {
  window_ = filled_ - 1;
  if (window_ == 0) return;
  velocity_mm_per_s_ = slope_from(readings_[static_cast<std::size_t>(newest_ - window_)]) * rate_hz_;
}

// A line of slope b through the newest position y_k at t_k passes within the bound d of an earlier one, y_j
// at t_j, iff b lies in [(y_k - y_j - d)/(t_k - t_j), (y_k - y_j + d)/(t_k - t_j)]; the window grows while
// its end slope lies in all of them.
void AdaptiveWindowVelocity::fit_end() noexcept {
  const Reading& newest = reading(0);
  double low = -HUGE_VAL;
  double high = HUGE_VAL;
  double slope = 0.0;
  int n = 1;
  for (; n <= points_; ++n) {
    const Reading& earlier = reading(n);
    const double per_period = 1.0 / (newest.periods - earlier.periods);
    const double candidate = (newest.position_mm - earlier.position_mm) * per_period;
    if (candidate < low || candidate > high) break;
    slope = candidate;
    const double slack = noise_bound_mm_ * per_period;
    low = std::max(candidate - slack, low);
    high = std::min(candidate + slack, high);
  }
  window_ = n - 1;
  velocity_mm_per_s_ = slope * rate_hz_;
}

void AdaptiveWindowVelocity::fit_best() noexcept {
  const Reading newest = reading(0);
  double accepted = slope_from(reading(1));
  window_ = 1;
  // Sums over the window of t, y, t² and t y, all less those of the newest.
  double sum_t = 0.0, sum_y = 0.0, sum_tt = 0.0, sum_ty = 0.0;
  for (int n = 1; n <= points_; ++n) {
    const double t = reading(n).periods - newest.periods;
    const double y = reading(n).position_mm - newest.position_mm;
    sum_t += t;
    sum_y += y;
    sum_tt += t * t;
    sum_ty += t * y;
    if (n == 1) continue;
    const double count = n + 1;
    const double slope = (count * sum_ty - sum_t * sum_y) / (count * sum_tt - sum_t * sum_t);
    bool within = true;
    for (int j = 1; j <= n && within; ++j) {
      const Reading& earlier = reading(j);
      const double on_line_mm = newest.position_mm + slope * (earlier.periods - newest.periods);
      within = std::abs(earlier.position_mm - on_line_mm) <= noise_bound_mm_;
    }
    if (!within) break;
    accepted = slope;
    window_ = n;
  }
  velocity_mm_per_s_ = accepted * rate_hz_;
}

}  // namespace hapticd::rt
