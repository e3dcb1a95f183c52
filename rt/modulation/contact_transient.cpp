#include "rt/modulation/contact_transient.h"

#include <algorithm>
#include <cmath>

#include "rt/signal/vector.h"

namespace hapticd::rt {

ContactTransient::ContactTransient(const TransientParameters& transient, const GripPlant& plant,
                                   double max_change_n, double rate_hz)
    : waveform_(transient, plant, rate_hz),
      needs_evidence_(transient.needs_evidence),
      max_force_n_(transient.max_force_n),
      max_change_n_(0.5 * max_change_n),
      mass_kg_(plant.mass_kg()),
      rate_hz_(rate_hz) {}

void ContactTransient::reset() noexcept {
  awaits_ = is_running_ = false;
  free_s_ = 1.0;
  force_n_ = share_ = impact_mm_per_s_ = speed_mm_per_s_ = 0.0;
}

void ContactTransient::begin(const Input& now) noexcept {
  awaits_ = false;
  is_running_ = true;
  normal_ = now.normal;
  max_authority_ = late_ticks_ = 0.0;
  ++count_;
  const double v = impact_mm_per_s_;
  speed_mm_per_s_ = v;
  const auto bound = [this](double peak, double most) {
    if (peak > 0.0) speed_mm_per_s_ = std::min(speed_mm_per_s_, most / peak);
  };
  bound(waveform_.peak_force_n(), max_force_n_);
  bound(waveform_.peak_change_n(), max_change_n_);
  // Both grow with the square of the speed; kg mm²/s² is 1e-3 mJ.
  const double impact_mj = 1e-3 * 0.5 * mass_kg_ * v * v;
  bound(std::sqrt(waveform_.peak_energy_mj()), std::sqrt(impact_mj));
  share_ = speed_mm_per_s_ / v;
  waveform_.restart();
}

hal::Vector3 ContactTransient::update(const Input& now) noexcept {
  force_n_ = 0.0;
  if (now.interval.is_gap || !finite(now.normal) || !std::isfinite(now.approach_mm_per_s + now.authority)) {
    awaits_ = is_running_ = false;
    return {};
  }
  if (now.just_declared) {
    impact_mm_per_s_ = now.approach_mm_per_s;
    awaits_ = free_s_ >= kQuietS && impact_mm_per_s_ >= kMinSpeedMmPerS && !is_running_;
    awaited_s_ = 0.0;
  }
  free_s_ = now.in_contact || is_running_ ? 0.0 : free_s_ + now.interval.s;
  if (awaits_) {
    awaited_s_ += now.interval.s;
    if (!now.in_contact || awaited_s_ > kAwaitS) {
      awaits_ = false;
    } else if (now.authority > 0.0 || !needs_evidence_) {
      begin(now);
    }
  }
  if (!is_running_) return {};
  max_authority_ = std::max(max_authority_, now.authority);
  late_ticks_ += now.interval.s * rate_hz_;
  const double ticks = std::round(late_ticks_);
  late_ticks_ -= ticks;
  waveform_.advance(static_cast<std::uint32_t>(std::max(0.0, ticks)));
  const double left = needs_evidence_ ? now.authority / max_authority_ : 1.0;
  if (waveform_.is_over() || !(left > 0.0)) {
    is_running_ = false;
    return {};
  }
  force_n_ = speed_mm_per_s_ * left * waveform_.force_n();
  return normal_ * force_n_;
}

}  // namespace hapticd::rt
