#include "rt/signal/adaptive_window_velocity.h"

#include <algorithm>
#include <cmath>

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
    : noise_bound_mm_(noise_bound_mm), rate_hz_(rate_hz), fit_(fit) {}

void AdaptiveWindowVelocity::reset() noexcept {
  filled_ = 0;
  window_ = 0;
  velocity_mm_per_s_ = 0.0;
}

double AdaptiveWindowVelocity::update(double position_mm) noexcept {
  newest_ = newest_ + 1 < 2 * kHeld ? newest_ + 1 : kHeld;
  positions_[static_cast<std::size_t>(newest_)] = position_mm;
  positions_[static_cast<std::size_t>(newest_ - kHeld)] = position_mm;
  filled_ = std::min(filled_ + 1, kHeld);
  if (filled_ > 1) fit_ == Fit::kEnd ? fit_end() : fit_best();
  return velocity_mm_per_s_;
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
  for (; n < filled_; ++n) {
    const double candidate = slope(n);
    if (candidate < low || candidate > high) break;
    const double slack = noise_bound_mm_ * kReciprocal[static_cast<std::size_t>(n)];
    low = std::max(candidate - slack, low);
    high = std::min(candidate + slack, high);
  }
  window_ = n - 1;
  velocity_mm_per_s_ = slope(window_) * rate_hz_;
}

void AdaptiveWindowVelocity::fit_best() noexcept {
  const double newest = position(0);
  double accepted = (newest - position(1)) * rate_hz_;
  window_ = 1;
  for (int n = 2; n < filled_; ++n) {
    double weighted = 0.0;
    for (int i = 0; i <= n; ++i) weighted += (n - 2 * i) * (position(i) - newest);
    const double slope = 6.0 * weighted * rate_hz_ / (static_cast<double>(n) * (n + 1) * (n + 2));
    bool within = true;
    for (int j = 1; j <= n && within; ++j) {
      within = std::abs(position(j) - (newest - slope * j / rate_hz_)) <= noise_bound_mm_;
    }
    if (!within) break;
    accepted = slope;
    window_ = n;
  }
  velocity_mm_per_s_ = accepted;
}

}  // namespace hapticd::rt
