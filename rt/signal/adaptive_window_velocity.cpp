#include "rt/signal/adaptive_window_velocity.h"

#include <algorithm>
#include <cmath>

#include "rt/signal/ticks.h"

namespace hapticd::rt {
namespace {

// 1/n: a division is as dear as all the rest of a step through the window.
constexpr auto kReciprocal = [] {
  std::array<double, AdaptiveWindowVelocity::kMaxWindow + 1> reciprocal{};
  for (std::size_t n = 1; n < reciprocal.size(); ++n) reciprocal[n] = 1.0 / static_cast<double>(n);
  return reciprocal;
}();

}  // namespace

AdaptiveWindowVelocity::AdaptiveWindowVelocity(double noise_bound_mm, double rate_hz, Fit fit) noexcept
    : noise_bound_mm_(noise_bound_mm),
      rate_hz_(rate_hz),
      spacing_(std::min(static_cast<int>(ticks_of(kSpacingS, rate_hz)), kWidestSpacing)),
      held_(kMaxWindow * spacing_ + 1),
      point_rate_hz_(rate_hz / spacing_),
      fit_(fit),
      newest_(held_) {}

void AdaptiveWindowVelocity::reset() noexcept {
  filled_ = 0;
  points_ = 0;
  window_ = 0;
  velocity_mm_per_s_ = 0.0;
}

double AdaptiveWindowVelocity::update(double position_mm) noexcept {
  newest_ = newest_ + 1 < 2 * held_ ? newest_ + 1 : held_;
  positions_[static_cast<std::size_t>(newest_)] = position_mm;
  positions_[static_cast<std::size_t>(newest_ - held_)] = position_mm;
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
  const double first = positions_[static_cast<std::size_t>(newest_ - window_)];
  velocity_mm_per_s_ = (position(0) - first) / window_ * rate_hz_;
}

// A line of slope b through the newest position passes within the bound of the position j periods ago iff b
// lies in
// [(y_k - y_{k-j} - d)/(jT), (y_k - y_{k-j} + d)/(jT)]; the window grows while its end slope lies in all of
// them.
void AdaptiveWindowVelocity::fit_end() noexcept {
  const double newest = position(0);
  double low = -HUGE_VAL;
  double high = HUGE_VAL;
  const auto slope = [&](int n) {  // per period
    return (newest - position(n)) * kReciprocal[static_cast<std::size_t>(n)];
  };
  int n = 1;
  for (; n <= points_; ++n) {
    const double candidate = slope(n);
    if (candidate < low || candidate > high) break;
    const double slack = noise_bound_mm_ * kReciprocal[static_cast<std::size_t>(n)];
    low = std::max(candidate - slack, low);
    high = std::min(candidate + slack, high);
  }
  window_ = n - 1;
  velocity_mm_per_s_ = slope(window_) * point_rate_hz_;
}

void AdaptiveWindowVelocity::fit_best() noexcept {
  const double newest = position(0);
  double accepted = (newest - position(1)) * point_rate_hz_;
  window_ = 1;
  for (int n = 2; n <= points_; ++n) {
    double weighted = 0.0;
    for (int i = 0; i <= n; ++i) weighted += (n - 2 * i) * (position(i) - newest);
    const double slope = 6.0 * weighted * point_rate_hz_ / (static_cast<double>(n) * (n + 1) * (n + 2));
    bool within = true;
    for (int j = 1; j <= n && within; ++j) {
      within = std::abs(position(j) - (newest - slope * j / point_rate_hz_)) <= noise_bound_mm_;
    }
    if (!within) break;
    accepted = slope;
    window_ = n;
  }
  velocity_mm_per_s_ = accepted;
}

}  // namespace hapticd::rt
