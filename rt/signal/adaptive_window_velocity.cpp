#include "rt/signal/adaptive_window_velocity.h"

#include <algorithm>
#include <cmath>
#include <type_traits>

#include "rt/signal/ticks.h"

namespace hapticd::rt {

namespace {

/// Calls `fit` for each axis: with what picks it from a vector of positions, and with its velocity.
template <class Fit>
void each_axis(double& velocity, Fit&& fit) noexcept {
  fit([](double v) { return v; }, velocity);
}
template <class Fit>
void each_axis(hal::Vector3& velocity, Fit&& fit) noexcept {
  fit([](const hal::Vector3& v) { return v.x; }, velocity.x);
  fit([](const hal::Vector3& v) { return v.y; }, velocity.y);
  fit([](const hal::Vector3& v) { return v.z; }, velocity.z);
}

}  // namespace

template <class Value>
BasicAdaptiveWindowVelocity<Value>::BasicAdaptiveWindowVelocity(double noise_bound_mm, double rate_hz,
                                                                Fit fit) noexcept
    : noise_bound_mm_(noise_bound_mm),
      rate_hz_(rate_hz),
      spacing_(std::min(static_cast<int>(ticks_of(kSpacingS, rate_hz)), kWidestSpacing)),
      held_(kMaxWindow * spacing_ + 1),
      fit_(fit),
      newest_(held_) {}

template <class Value>
void BasicAdaptiveWindowVelocity<Value>::reset() noexcept {
  filled_ = 0;
  points_ = 0;
  window_ = 0;
  velocity_mm_per_s_ = Value{};
}

template <class Value>
const Value& BasicAdaptiveWindowVelocity<Value>::update(const Value& position_mm, double periods) noexcept {
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
template <class Value>
void BasicAdaptiveWindowVelocity<Value>::fit_first() noexcept {
  window_ = filled_ - 1;
  if (window_ == 0) return;
  const Reading& newest = reading(0);
  const Reading& first = readings_[static_cast<std::size_t>(newest_ - window_)];
  each_axis(velocity_mm_per_s_, [&](auto of, double& velocity_mm_per_s) {
    velocity_mm_per_s =
        (of(newest.position_mm) - of(first.position_mm)) / (newest.periods - first.periods) * rate_hz_;
  });
}

// A line of slope b through the newest position y_k at t_k passes within the bound d of an earlier one, y_j
// at t_j, iff b lies in [(y_k - y_j - d)/(t_k - t_j), (y_k - y_j + d)/(t_k - t_j)]; the window grows while
// its end slope lies in all of them.
template <class Value>
void BasicAdaptiveWindowVelocity<Value>::fit_end() noexcept {
  constexpr bool kSharesTimes = std::is_same_v<Value, hal::Vector3>;
  const Reading* const newest = &reading(0);
  const auto per_period = [newest](const Reading* earlier) {
    return 1.0 / (newest->periods - earlier->periods);
  };
  std::array<double, kMaxWindow> shared;  // 1/(t_k - t_j), for all axes
  if constexpr (kSharesTimes) {
    for (int n = 0; n < points_; ++n)
      shared[static_cast<std::size_t>(n)] = per_period(newest - (n + 1) * spacing_);
  }
  window_ = points_;
  each_axis(velocity_mm_per_s_, [&](auto of, double& velocity_mm_per_s) {
    const double newest_mm = of(newest->position_mm);
    double low = -HUGE_VAL;
    double high = HUGE_VAL;
    double slope = 0.0;
    const Reading* earlier = newest - spacing_;
    int n = 0;
    for (; n < points_; ++n, earlier -= spacing_) {
      const double inverse = kSharesTimes ? shared[static_cast<std::size_t>(n)] : per_period(earlier);
      const double candidate = (newest_mm - of(earlier->position_mm)) * inverse;
      if (candidate < low || candidate > high) break;
      slope = candidate;
      const double slack = noise_bound_mm_ * inverse;
      low = std::max(candidate - slack, low);
      high = std::min(candidate + slack, high);
    }
    window_ = std::min(window_, n);
    velocity_mm_per_s = slope * rate_hz_;
  });
}

template <class Value>
void BasicAdaptiveWindowVelocity<Value>::fit_best() noexcept {
  const Reading& newest = reading(0);
  window_ = points_;
  each_axis(velocity_mm_per_s_, [&](auto of, double& velocity_mm_per_s) {
    const double newest_mm = of(newest.position_mm);
    double accepted = 0.0;
    int window = 1;
    // Sums over the window of t, y, t² and t y, all less those of the newest.
    double sum_t = 0.0, sum_y = 0.0, sum_tt = 0.0, sum_ty = 0.0;
    for (int n = 1; n <= points_; ++n) {
      const double t = reading(n).periods - newest.periods;
      const double y = of(reading(n).position_mm) - newest_mm;
      sum_t += t;
      sum_y += y;
      sum_tt += t * t;
      sum_ty += t * y;
      if (n == 1) {
        accepted = y / t;
        continue;
      }
      const double count = n + 1;
      const double slope = (count * sum_ty - sum_t * sum_y) / (count * sum_tt - sum_t * sum_t);
      bool within = true;
      for (int j = 1; j <= n && within; ++j) {
        const Reading& earlier = reading(j);
        const double on_line_mm = newest_mm + slope * (earlier.periods - newest.periods);
        within = std::abs(of(earlier.position_mm) - on_line_mm) <= noise_bound_mm_;
      }
      if (!within) break;
      accepted = slope;
      window = n;
    }
    window_ = std::min(window_, window);
    velocity_mm_per_s = accepted * rate_hz_;
  });
}

template class BasicAdaptiveWindowVelocity<double>;
template class BasicAdaptiveWindowVelocity<hal::Vector3>;

}  // namespace hapticd::rt
