#include "rt/identify/ultimate_oscillation.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace hapticd::rt {

namespace {
constexpr double kMeanHz = 2.0;  // cut-off of the mean that it swings about
}

UltimateOscillation::UltimateOscillation(double rate_hz, double least_mm) noexcept
    : period_tick_s_(1.0 / rate_hz),
      least_mm_(least_mm),
      slow_share_(1.0 - std::exp(-2.0 * std::numbers::pi * kMeanHz / rate_hz)) {}

void UltimateOscillation::reset() noexcept {
  *this = UltimateOscillation(1.0 / period_tick_s_, least_mm_);
}

void UltimateOscillation::update(double position_mm) noexcept {
  if (!std::isfinite(position_mm)) return;
  if (!started_) {
    started_ = true;
    slow_mm_ = position_mm;
    return;
  }
  slow_mm_ += slow_share_ * (position_mm - slow_mm_);
  const double swing_mm = position_mm - slow_mm_;
  since_s_ += period_tick_s_;
  extreme_mm_ = std::max(extreme_mm_, std::abs(swing_mm));
  // A crossing counts once the half-cycle was worth it: encoder steps about the mean are none.
  if (swing_mm * last_mm_ < 0.0) {
    if (extreme_mm_ >= least_mm_) {
      std::move(halves_.begin() + 1, halves_.end(), halves_.begin());
      halves_.back() = {extreme_mm_, since_s_};
      count_ = std::min(count_ + 1, kHalves);
      judge();
    } else {
      count_ = 0;
    }
    since_s_ = 0.0;
    extreme_mm_ = 0.0;
  }
  if (since_s_ > 0.5 / kLowestHz) count_ = 0;
  if (swing_mm != 0.0) last_mm_ = swing_mm;
}

void UltimateOscillation::judge() noexcept {
  if (count_ < 6) {
    if (count_ >= 3) {
      const Half& last = halves_[kHalves - 1];
      violent_ = violent_ ||
                 (last.amplitude_mm > kViolentMm && last.amplitude_mm > halves_[kHalves - 3].amplitude_mm);
    }
    return;
  }
  double early = 0.0, late = 0.0, shortest = 1e9, longest = 0.0, whole = 0.0;
  for (std::size_t i = 0; i < 6; ++i) {
    const Half& half = halves_[kHalves - 6 + i];
    (i < 3 ? early : late) += half.amplitude_mm / 3.0;
    shortest = std::min(shortest, half.duration_s);
    longest = std::max(longest, half.duration_s);
    whole += half.duration_s / 3.0;
  }
  const bool in_band = whole * kLowestHz <= 1.0 && whole * kHighestHz >= 1.0;
  if (in_band && longest <= kRegular * shortest && late >= kKeeps * early) {
    sustained_ = true;
    period_s_ = whole;
    amplitude_mm_ = late;
  }
  if (late > kViolentMm && late > early) {
    violent_ = true;
    period_s_ = whole;
    amplitude_mm_ = late;
  }
}

}  // namespace hapticd::rt
