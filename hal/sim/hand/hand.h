#pragma once

#include <cstdint>
#include <string>

#include "hal/samples.h"

namespace hapticd::sim {

/// What the simulated hand intends. Motions are minimum-jerk; the hand follows them through its own
/// impedance.
struct HandProgram {
  enum class Kind : std::uint8_t {
    kRest,    ///< holds the tool still above the object
    kTap,     ///< strikes the object repeatedly: `speed_mm_per_s` at the surface, `rate_hz` taps a second
    kPress,   ///< approaches slowly, then presses to `force_n` (or `depth_mm` if that is > 0) and holds
    kStroke,  ///< presses with `force_n` and moves along `stroke_direction` and back
    kWeight,  ///< a passive mass on the grip, no hand (D§3.3.2): lowered onto the object and left there
    kShake,   ///< free motion driven by the device: a sinusoidal force of `force_n` at `rate_hz` (D§3.2.2)
    kSway,    ///< waves the tool in free air: up to `speed_mm_per_s` each way, at `rate_hz` and close to it
    kScan,    ///< touches lightly, `repetitions` times, along `stroke_direction` from home over
              ///< `stroke_length_mm`, following the surface; `speed_mm_per_s` at the surface
    kDart,    ///< abrupt motion in free air: `stroke_length_mm` along `shake_direction` and back, with
              ///< `speed_mm_per_s` between ends and `acceleration_m_per_s2` at them, `rate_hz` times a second
    kFollow,  ///< holds the tool loosely and goes along with whatever leads it
  };
  Kind kind = Kind::kRest;
  double force_n = 2.0;
  double depth_mm = 0.0;            ///< press; scan: how far below the surface it means to go, 0 = 1 mm
  double force_rate_n_per_s = 2.0;  ///< how fast a press builds up
  double approach_mm_per_s = 15.0;  ///< guided approach before a press (D§3.4.1)
  double speed_mm_per_s = 400.0;    ///< tap: at the surface, downwards; stroke: along the surface
  double rate_hz = 1.5;
  double hold_s = 2.0;  ///< press: time at full force before release; sway: of waving; negative = for ever
  int repetitions = 1;  ///< press, tap, stroke; negative = for ever
  hal::Vector3 stroke_direction{1.0, 0.0, 0.0};
  double stroke_length_mm = 50.0;
  double mass_g = 408.0;  ///< weight
  double knock_n = 0.0;   ///< press, stroke, weight: a half-sine of 20 ms every two seconds, to disturb
  hal::Vector3 shake_direction{0.0, 0.0, 1.0};
  double tap_slant_deg = 0.0;  ///< tap: path from the vertical, towards `stroke_direction`; meets home there
  /// Any: where its home is, next to (x, y) or above (z) the usual one. Heights move with it: a tap strikes
  /// at z = place_mm.z, a depth counts from there; a force is sought wherever it is met.
  hal::Vector3 place_mm{};
  double travel_s = 0.0;  ///< any: time to come home from wherever the hand is; 0 = at leisure
  /// A hand's own spring and damper along the press and across it, times what is usual (hand_motion.cpp).
  /// Without meaning for a weight and a shaken device.
  double grip_stiffness_scale = 1.0;
  double grip_damping_scale = 1.0;
  double tilt_deg = 0.0;                ///< any: amplitude of the tool's sway about x and about y
  double twist_deg = 0.0;               ///< any: amplitude of its sway about z
  double acceleration_m_per_s2 = 20.0;  ///< dart
};

/// Time at which a program is over and the tool free again, counted from its start; an upper bound as far as
/// it depends on what is touched. Infinite if it never ends by itself. A program that has only a posture to
/// keep (rest, sway, weight, shake) is over when the hand has come home.
double planned_duration_s(const HandProgram& program);

}  // namespace hapticd::sim
