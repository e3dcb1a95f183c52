#pragma once

#include <array>
#include <cstdint>

#include "hal/samples.h"
#include "hal/sim/base/conditions.h"
#include "hal/sim/base/random.h"

namespace hapticd::sim {

/// Motion of the table with device and object, in a room at rest.
struct BaseMotion {
  hal::Vector3 position_mm;
  hal::Vector3 velocity_mm_per_s;
  hal::Vector3 acceleration_mm_per_s2;
};

/// A table that rings after occasional knocks, or vibrates continuously: closed forms, so that position,
/// velocity and acceleration are consistent. One knock rings at a time, with its own frequency and
/// direction.
class BaseVibration {
 public:
  BaseVibration(const Conditions& conditions, std::uint64_t seed) noexcept;

  bool active() const noexcept { return conditions_.vibration_m_per_s2 > 0.0; }
  /// Motion at a time; times must not decrease.
  BaseMotion at(double time_s) noexcept;

 private:
  struct Tone {
    double rad_per_s = 0.0;
    double amplitude_mm = 0.0;
    double phase = 0.0;
    hal::Vector3 direction;
  };
  Tone tone(double acceleration_m_per_s2, double phase) noexcept;

  Conditions conditions_;
  Random random_;
  std::array<Tone, 3> hum_{};  ///< continuous vibration
  Tone knock_;
  double knock_at_s_ = 0.0;
  double next_knock_s_ = 0.0;
};

}  // namespace hapticd::sim
