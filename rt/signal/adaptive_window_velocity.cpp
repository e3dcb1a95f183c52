#include "rt/signal/adaptive_window_velocity.h"

#include <algorithm>
#include <cmath>

#include "rt/signal/number_pair.h"
#include "rt/signal/ticks.h"

namespace hapticd::rt {

namespace {

double& axis_of(double& value, std::size_t) noexcept {
  return value;
}
double& axis_of(hal::Vector3& value, std::size_t axis) noexcept {
  return axis == 0 ? value.x : axis == 1 ? value.y : value.z;
}
double axis_of(const double& value, std::size_t) noexcept {
  return value;
}
double axis_of(const hal::Vector3& value, std::size_t axis) noexcept {
  return axis == 0 ? value.x : axis == 1 ? value.y : value.z;
}

/// Times of a window's points, the same for all axes. What is made of them is made once it is asked for.
class Spans {
 public:
  static constexpr std::size_t kLast = AdaptiveWindowVelocity::kMaxWindow;

  /// `periods`: of the newest point, and then of those before it.
  explicit Spans(const double* periods) noexcept : periods_(periods) {}

  /// 1/(t_k - t_j) of the points j before the newest k.
  const double* inverses() noexcept {
    if (!has_inverses_) {
      has_inverses_ = true;
      for (std::size_t n = 1; n < kLast; n += 2) set_inverses(n);
      set_inverses(kLast - 1);
    }
    return inverses_.data();
  }

  /// Line along the ends of a longest window, with all of its points.
  EvenLine along_ends(const double* mm) noexcept {
    if (!has_steps_) set_steps();
    const double slope = ((mm[0] + mm[1] + mm[2]) - (mm[kLast - 2] + mm[kLast - 1] + mm[kLast])) * per_ends_;
    const NumberPair newest_mm{mm[0], mm[0]};
    const NumberPair slopes{slope, slope};
    NumberPair most = newest_mm;
    NumberPair least = newest_mm;
    const auto look = [&](std::size_t n) {
      const NumberPair aside = NumberPair{mm[n], mm[n + 1]} - slopes * steps_[n / 2];
      most = larger(aside, most);
      least = smaller(aside, least);
    };
    for (std::size_t n = 1; n < kLast; n += 2) look(n);
    look(kLast - 1);
    return {periods_[0], mm[0], slope, std::min(least[0], least[1]) - mm[0],
            std::max(most[0], most[1]) - mm[0]};
  }

 private:
  static_assert(kLast % 2 == 1);

  NumberPair times(std::size_t n) const noexcept { return NumberPair{periods_[n], periods_[n + 1]}; }
  void set_inverses(std::size_t n) noexcept {
    const NumberPair inverses = 1.0 / (periods_[0] - times(n));
    inverses_[n] = inverses[0];
    inverses_[n + 1] = inverses[1];
  }
  void set_steps() noexcept {
    has_steps_ = true;
    const NumberPair newest{periods_[0], periods_[0]};
    for (std::size_t n = 1; n < kLast; n += 2) steps_[n / 2] = times(n) - newest;
    steps_[kLast / 2] = times(kLast - 1) - newest;
    per_ends_ = 1.0 / ((periods_[0] + periods_[1] + periods_[2]) -
                       (periods_[kLast - 2] + periods_[kLast - 1] + periods_[kLast]));
  }

  const double* periods_;
  bool has_inverses_ = false;
  bool has_steps_ = false;
  double per_ends_ = 0.0;
  std::array<double, kLast + 1> inverses_;
  std::array<NumberPair, kLast / 2 + 1> steps_;  // t_j - t_k, of two points each
};

}  // namespace

template <class Value>
BasicAdaptiveWindowVelocity<Value>::BasicAdaptiveWindowVelocity(double noise_bound_mm, double rate_hz,
                                                                Fit fit) noexcept
    : noise_bound_mm_(noise_bound_mm),
      rate_hz_(rate_hz),
      spacing_(std::min(static_cast<int>(ticks_of(kSpacingS, rate_hz)), kWidestSpacing)),
      fit_(fit) {}

template <class Value>
void BasicAdaptiveWindowVelocity<Value>::reset() noexcept {
  filled_ = 0;
  points_ = 0;
  window_ = 0;
  was_even_ = {};
  velocity_mm_per_s_ = Value{};
}

template <class Value>
inline void BasicAdaptiveWindowVelocity<Value>::take(const Value& position_mm, double periods) noexcept {
  periods_ = filled_ == 0 ? 0.0 : periods_ + periods;
  if (++phase_ >= static_cast<std::size_t>(spacing_)) {
    phase_ = 0;
    newest_ = newest_ > 0 ? newest_ - 1 : kPoints - 1;
  }
  Readings& readings = readings_[phase_];
  readings.periods[newest_] = readings.periods[newest_ + kPoints] = periods_;
  for (std::size_t axis = 0; axis < kAxes; ++axis) {
    Ring& ring = readings.positions_mm[axis];
    ring[newest_] = ring[newest_ + kPoints] = axis_of(position_mm, axis);
  }
  if (filled_ <= kMaxWindow * spacing_) [[unlikely]] {
    if (filled_ == 0) first_mm_ = position_mm;
    points_ = filled_++ / spacing_;
  }
}

template <class Value>
const Value& BasicAdaptiveWindowVelocity<Value>::update(const Value& position_mm, double periods) noexcept {
  take(position_mm, periods);
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
  const Readings& readings = readings_[phase_];
  for (std::size_t axis = 0; axis < kAxes; ++axis) {
    const double newest_mm = readings.positions_mm[axis][newest_];
    axis_of(velocity_mm_per_s_, axis) =
        (newest_mm - axis_of(first_mm_, axis)) / readings.periods[newest_] * rate_hz_;
  }
}

// A line of slope b through the newest position y_k at t_k passes within the bound d of an earlier one, y_j
// at t_j, iff b lies in [(y_k - y_j - d)/(t_k - t_j), (y_k - y_j + d)/(t_k - t_j)]; the window grows while
// its end slope lies in all of them.
//
// It is certain that all points of a longest window would be accepted if they lie within a band as wide as
// the bound. Let them lie r_j aside of some line, less what the newest one does. The line from the newest to
// point n passes a nearer point j at a distance |r_j - ρ r_n|, 0 < ρ < 1. So none is farther off than the r
// of all points spread, the newest's 0 among them. Rounding has room.
template <class Value>
void BasicAdaptiveWindowVelocity<Value>::fit_end() noexcept {
  Readings& readings = readings_[phase_];
  const double* const periods = &readings.periods[newest_];
  Spans spans(periods);
  constexpr double kRounding = 1e-6;
  const double band_mm = noise_bound_mm_ * (1.0 - kRounding);
  window_ = points_;
  for (std::size_t axis = 0; axis < kAxes; ++axis) {
    const double* const mm = &readings.positions_mm[axis][newest_];
    EvenLine& line = readings.lines[axis];
    if (was_even_[axis] &&
        (line.takes(periods[0], mm[0], band_mm) || (line = spans.along_ends(mm)).width_mm() <= band_mm)) {
      const double per_longest = 1.0 / (periods[0] - periods[kMaxWindow]);
      axis_of(velocity_mm_per_s_, axis) = (mm[0] - mm[kMaxWindow]) * per_longest * rate_hz_;
      continue;
    }
    line.forget();
    const double* span = kAxes > 1 ? spans.inverses() : periods;
    const double* earlier_mm = mm;
    double low = -HUGE_VAL;
    double high = HUGE_VAL;
    double slope = 0.0;
    for (const double* const end_mm = mm + points_; earlier_mm != end_mm; ++earlier_mm) {
      const double per_period = kAxes > 1 ? *++span : 1.0 / (periods[0] - *++span);
      const double candidate = (mm[0] - earlier_mm[1]) * per_period;
      if (candidate < low || candidate > high) break;
      slope = candidate;
      const double slack = noise_bound_mm_ * per_period;
      low = std::max(candidate - slack, low);
      high = std::min(candidate + slack, high);
    }
    const auto n = static_cast<int>(earlier_mm - mm);
    window_ = std::min(window_, n);
    was_even_[axis] = n == kMaxWindow;
    axis_of(velocity_mm_per_s_, axis) = slope * rate_hz_;
  }
}

template <class Value>
void BasicAdaptiveWindowVelocity<Value>::fit_best() noexcept {
  const Readings& readings = readings_[phase_];
  const double* const periods = &readings.periods[newest_];
  window_ = points_;
  for (std::size_t axis = 0; axis < kAxes; ++axis) {
    const double* const mm = &readings.positions_mm[axis][newest_];
    double accepted = 0.0;
    int window = 1;
    // Sums over the window of t, y, t² and t y, all less those of the newest.
    double sum_t = 0.0, sum_y = 0.0, sum_tt = 0.0, sum_ty = 0.0;
    for (int n = 1; n <= points_; ++n) {
      const double t = periods[n] - periods[0];
      const double y = mm[n] - mm[0];
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
        const double on_line_mm = mm[0] + slope * (periods[j] - periods[0]);
        within = std::abs(mm[j] - on_line_mm) <= noise_bound_mm_;
      }
      if (!within) break;
      accepted = slope;
      window = n;
    }
    window_ = std::min(window_, window);
    axis_of(velocity_mm_per_s_, axis) = accepted * rate_hz_;
  }
}

template class BasicAdaptiveWindowVelocity<double>;
template class BasicAdaptiveWindowVelocity<hal::Vector3>;

}  // namespace hapticd::rt
