#pragma once

#include "hal/sim/hand/hand.h"

namespace hapticd::study {

/// The hand programs that the studies of the rig share.

/// Presses to a force and stays there.
inline sim::HandProgram pressing(double force_n) {
  sim::HandProgram hand;
  hand.kind = sim::HandProgram::Kind::kPress;
  hand.force_n = force_n;
  hand.hold_s = -1.0;
  return hand;
}

/// Strokes back and forth without an end.
inline sim::HandProgram stroking(double force_n, double speed_mm_per_s, double length_mm = 40.0,
                                 double approach_mm_per_s = 30.0, double force_rate_n_per_s = 4.0) {
  sim::HandProgram hand;
  hand.kind = sim::HandProgram::Kind::kStroke;
  hand.force_n = force_n;
  hand.speed_mm_per_s = speed_mm_per_s;
  hand.stroke_length_mm = length_mm;
  hand.repetitions = -1;
  hand.approach_mm_per_s = approach_mm_per_s;
  hand.force_rate_n_per_s = force_rate_n_per_s;
  return hand;
}

/// The free motion of D§3.2.2: the device shakes itself at 5 Hz and 1 N.
inline sim::HandProgram shaken() {
  sim::HandProgram hand;
  hand.kind = sim::HandProgram::Kind::kShake;
  hand.force_n = 1.0;
  hand.rate_hz = 5.0;
  return hand;
}

/// Strikes about once a second; no multiple of the tick, so that contacts fall anywhere between two samples.
inline sim::HandProgram tapping(double speed_mm_per_s, int repetitions = -1) {
  sim::HandProgram hand;
  hand.kind = sim::HandProgram::Kind::kTap;
  hand.speed_mm_per_s = speed_mm_per_s;
  hand.rate_hz = 0.977;
  hand.repetitions = repetitions;
  return hand;
}

}  // namespace hapticd::study
