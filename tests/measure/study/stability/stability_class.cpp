#include "tests/measure/study/stability/stability_class.h"

#include <algorithm>
#include <cmath>

namespace hapticd::study {

std::string_view to_text(StabilityClass c) noexcept {
  switch (c) {
    case StabilityClass::kStable:
      return "stable";
    case StabilityClass::kSlowMode:
      return "slow mode";
    case StabilityClass::kLimitCycle:
      return "limit cycle";
    case StabilityClass::kDiverging:
      return "diverging";
    case StabilityClass::kUndetected:
      return "undetected";
    case StabilityClass::kContactLost:
      return "contact lost";
    case StabilityClass::kGuardLatched:
      return "guard latched";
  }
  return "";
}

StabilityJudge::StabilityJudge(double rate_hz)
    : window_ticks_(static_cast<std::size_t>(rate_hz / kWindowsPerSecond)),
      position_(rate_hz),
      force_(rate_hz, kVisibleN) {}

void StabilityJudge::add(const Tick& tick) {
  position_.add(tick.position_mm);
  force_.add(tick.reaction_n);
  latched_ = latched_ || tick.latched;
  now_.mean_mm += tick.position_mm / static_cast<double>(window_ticks_);
  if (!tick.touching) ++now_.off;
  if (tick.touching && !tick.detected) ++now_.missed;
  if (++ticks_ < window_ticks_) return;
  windows_.push_back(now_);
  now_ = {};
  ticks_ = 0;
}

StabilityClass StabilityJudge::verdict() const {
  if (latched_) return StabilityClass::kGuardLatched;
  const std::size_t last = std::min(windows_.size(), kWindowsPerSecond);
  std::size_t off = 0;
  std::size_t missed = 0;
  for (std::size_t i = windows_.size() - last; i < windows_.size(); ++i) {
    off += windows_[i].off;
    missed += windows_[i].missed;
  }
  const double allowed = kLostShare * static_cast<double>(last * window_ticks_);
  if (static_cast<double>(off) > allowed) return StabilityClass::kContactLost;
  if (static_cast<double>(missed) > allowed) return StabilityClass::kUndetected;
  if (position_.grows() || force_.grows()) return StabilityClass::kDiverging;
  if (position_.oscillates() || force_.oscillates()) return StabilityClass::kLimitCycle;
  if (windows_.size() > kWindowsPerSecond) {
    const double before_mm = windows_[windows_.size() - 1 - kWindowsPerSecond].mean_mm;
    if (std::abs(windows_.back().mean_mm - before_mm) > OscillationJudge::kVisibleMm) {
      return StabilityClass::kSlowMode;
    }
  }
  return StabilityClass::kStable;
}

}  // namespace hapticd::study
