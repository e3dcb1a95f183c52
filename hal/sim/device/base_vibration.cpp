#include "hal/sim/device/base_vibration.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace hapticd::sim {

namespace {

/// A factor and its first two time derivatives.
struct Envelope {
  double value = 1.0;
  double first = 0.0;
  double second = 0.0;
};

// u² exp(2 - 2u), u = t/τ: begins and ends without a step in acceleration, 1 at its highest.
Envelope knock_envelope(double since_s, double tau_s) noexcept {
  const double u = since_s / tau_s;
  if (u <= 0.0) return {0.0, 0.0, 0.0};
  const double e = std::exp(2.0 - 2.0 * u);
  return {u * u * e, (2.0 * u - 2.0 * u * u) * e / tau_s,
          (2.0 - 8.0 * u + 4.0 * u * u) * e / (tau_s * tau_s)};
}

// Quintic from 0 to 1 in a second.
Envelope soft_start(double since_s) noexcept {
  const double s = std::clamp(since_s, 0.0, 1.0);
  return {s * s * s * (10.0 + s * (-15.0 + 6.0 * s)), 30.0 * s * s * (1.0 - s) * (1.0 - s),
          60.0 * s * (1.0 - s) * (1.0 - 2.0 * s)};
}

}  // namespace

BaseVibration::BaseVibration(const Conditions& conditions, std::uint64_t seed) noexcept
    : conditions_(conditions),
      random_(seed ^ 0x7461626c65ULL),
      next_knock_s_(conditions.vibration_interval_s) {
  if (!active() || conditions.vibration_interval_s > 0.0) return;
  for (Tone& part : hum_)
    part = tone(conditions.vibration_m_per_s2 / 3.0, 2.0 * std::numbers::pi * random_.uniform());
}

BaseVibration::Tone BaseVibration::tone(double acceleration_m_per_s2, double phase) noexcept {
  // Frequencies uniform on a logarithmic scale.
  const double hz = conditions_.vibration_low_hz *
                    std::pow(conditions_.vibration_high_hz / conditions_.vibration_low_hz, random_.uniform());
  hal::Vector3 direction{random_.normal(), random_.normal(), random_.normal()};
  direction = direction * (1.0 / std::max(1e-6, std::sqrt(dot(direction, direction))));
  const double rad_per_s = 2.0 * std::numbers::pi * hz;
  return {rad_per_s, 1e3 * acceleration_m_per_s2 / (rad_per_s * rad_per_s), phase, direction};
}

BaseMotion BaseVibration::at(double time_s) noexcept {
  BaseMotion motion;
  if (!active()) return motion;
  const auto add = [&](const Tone& part, const Envelope& w, double since_s) {
    const double angle = part.rad_per_s * since_s + part.phase;
    const double s = part.amplitude_mm * std::sin(angle);
    const double c = part.amplitude_mm * part.rad_per_s * std::cos(angle);
    motion.position_mm = motion.position_mm + part.direction * (w.value * s);
    motion.velocity_mm_per_s = motion.velocity_mm_per_s + part.direction * (w.first * s + w.value * c);
    motion.acceleration_mm_per_s2 =
        motion.acceleration_mm_per_s2 +
        part.direction * (w.second * s + 2.0 * w.first * c - w.value * part.rad_per_s * part.rad_per_s * s);
  };
  if (conditions_.vibration_interval_s <= 0.0) {
    for (const Tone& part : hum_) add(part, soft_start(time_s), time_s);
    return motion;
  }
  if (time_s >= next_knock_s_) {
    knock_at_s_ = time_s;
    next_knock_s_ = time_s + conditions_.vibration_interval_s;
    knock_ = tone(conditions_.vibration_m_per_s2, 0.0);
  }
  if (knock_.amplitude_mm == 0.0) return motion;
  // Rings for a few of its periods; at the next knock less than a millionth is left.
  const double since_s = time_s - knock_at_s_;
  const double tau_s = std::min(std::max(0.06, 4.0 * std::numbers::pi / knock_.rad_per_s),
                                0.08 * conditions_.vibration_interval_s);
  add(knock_, knock_envelope(since_s, tau_s), since_s);
  return motion;
}

}  // namespace hapticd::sim
