#include "server/identification/estimate/ultimate_oscillation.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace hapticd::identification {

namespace {
constexpr double kMeanHz = 2.0;  // cut-off of the mean that it swings about
}

UltimateOscillation::UltimateOscillation(double rate_hz, double least, double violent) noexcept
    : period_tick_s_(1.0 / rate_hz),
      least_(least),
      violent_size_(violent),
      slow_share_(1.0 - std::exp(-2.0 * std::numbers::pi * kMeanHz / rate_hz)) {}

void UltimateOscillation::reset() noexcept {
  *this = UltimateOscillation(1.0 / period_tick_s_, least_, violent_size_);
}

void UltimateOscillation::update(double value) noexcept {
  if (!std::isfinite(value)) return;
  if (!started_) {
    started_ = true;
    slow_ = value;
    return;
  }
  slow_ += slow_share_ * (value - slow_);
  const double swing = value - slow_;
  since_s_ += period_tick_s_;
  extreme_ = std::max(extreme_, std::abs(swing));
  // A crossing counts once the half-cycle was large enough: encoder steps about the mean do not count.
  if (swing * last_ < 0.0) {
    if (extreme_ >= least_) {
      std::move(halves_.begin() + 1, halves_.end(), halves_.begin());
      halves_.back() = {extreme_, since_s_};
      count_ = std::min(count_ + 1, kHalves);
      judge();
    } else {
      count_ = 0;
    }
    since_s_ = 0.0;
    extreme_ = 0.0;
  }
  if (since_s_ > 0.5 / kMinHz) count_ = 0;
  if (swing != 0.0) last_ = swing;
}

double UltimateOscillation::period_s() const noexcept {
  if (period_s_ > 0.0 || count_ == 0) return period_s_;
  const std::size_t halves = std::min<std::size_t>(count_, 3);
  double duration_s = 0.0;
  for (std::size_t i = 0; i < halves; ++i) duration_s += halves_[kHalves - 1 - i].duration_s;
  return 2.0 * duration_s / static_cast<double>(halves);
}

void UltimateOscillation::judge() noexcept {
  if (count_ < 6) {
    if (count_ >= 3) {
      const Half& last = halves_[kHalves - 1];
      violent_ =
          violent_ || (last.amplitude > violent_size_ && last.amplitude > halves_[kHalves - 3].amplitude);
    }
    return;
  }
  double early = 0.0, late = 0.0, shortest = 1e9, longest = 0.0, whole = 0.0;
  for (std::size_t i = 0; i < 6; ++i) {
    const Half& half = halves_[kHalves - 6 + i];
    (i < 3 ? early : late) += half.amplitude / 3.0;
    shortest = std::min(shortest, half.duration_s);
    longest = std::max(longest, half.duration_s);
    whole += half.duration_s / 3.0;
  }
  const bool in_band = whole * kMinHz <= 1.0 && whole * kMaxHz >= 1.0;
  if (in_band && longest <= kRegular * shortest && late >= kKeeps * early) {
    sustained_ = true;
    period_s_ = whole;
    amplitude_ = late;
  }
  if (late > violent_size_ && late > early) {
    violent_ = true;
    period_s_ = whole;
    amplitude_ = late;
  }
}

}  // namespace hapticd::identification
