#include "server/palpation/simulated_palpator.h"

#include <algorithm>
#include <cmath>

namespace hapticd::server {

namespace {

using Kind = sim::HandProgram::Kind;
using Motion = rt::Wish::Motion;

constexpr double kMinimumJerkPeak = 1.875;  // fastest over mean
constexpr double kWayDownS = 1.0;           // from wherever the hand is to its home, and down to the surface
constexpr double kRecoveryS = 1.0;          // back up, and the object recovers

Kind kind_of(Motion motion) {
  switch (motion) {
    case Motion::kPress:
      return Kind::kPress;
    case Motion::kTap:
    case Motion::kStrikeFree:
    case Motion::kLightTaps:
      return Kind::kTap;
    case Motion::kStroke:
      return Kind::kStroke;
    case Motion::kRest:
    case Motion::kSway:
      break;
  }
  return Kind::kRest;
}

}  // namespace

SimulatedMotion simulated_motion(const rt::Wish& wish) {
  SimulatedMotion motion;
  sim::HandProgram& hand = motion.program;
  hand.kind = kind_of(wish.motion);
  hand.tilt_deg = wish.tilt_deg;
  hand.place_mm = wish.place_mm;
  hand.repetitions = std::max(1, wish.repetitions);
  if (wish.force_n > 0.0) hand.force_n = wish.force_n;
  if (wish.force_rate_n_per_s > 0.0) hand.force_rate_n_per_s = wish.force_rate_n_per_s;
  if (wish.speed_mm_per_s > 0.0) hand.speed_mm_per_s = wish.speed_mm_per_s;
  hand.hold_s = wish.hold_s;
  hand.approach_mm_per_s = 40.0;
  const double build_up_s = kMinimumJerkPeak * hand.force_n / hand.force_rate_n_per_s;
  switch (wish.motion) {
    case Motion::kPress:
      motion.duration_s = hand.repetitions * (kWayDownS + build_up_s + hand.hold_s + kRecoveryS);
      break;
    case Motion::kStroke:
      hand.stroke_length_mm = wish.length_mm > 0.0 ? wish.length_mm : hand.stroke_length_mm;
      motion.duration_s =
          kWayDownS + build_up_s + 0.5 + kRecoveryS +
          2.0 * (hand.repetitions + 0.5) * kMinimumJerkPeak * hand.stroke_length_mm / hand.speed_mm_per_s;
      break;
    case Motion::kTap:
    case Motion::kStrikeFree:
    case Motion::kLightTaps:
      motion.duration_s = kWayDownS + hand.repetitions / hand.rate_hz;
      break;
    case Motion::kRest:
    case Motion::kSway:
      motion.duration_s = std::max(1.0, wish.hold_s);
      break;
  }
  return motion;
}

}  // namespace hapticd::server
