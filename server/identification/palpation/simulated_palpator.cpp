#include "server/identification/palpation/simulated_palpator.h"

#include <algorithm>

namespace hapticd::server {

namespace {

using Kind = sim::HandProgram::Kind;
using Motion = identification::MotionRequest::Motion;

constexpr double kFirmGrip = 8.0, kFirmGripDamping = 3.0;  // over those of a relaxed grip
constexpr double kTravelS = 1.0;                           // from wherever the last request left the hand
constexpr double kFreeHeightMm = 80.0;                     // where surely no object is
constexpr double kSwayMmPerS = 150.0;
constexpr double kSwayHz = 1.2;
constexpr double kSwayTiltDeg = 45.0;
constexpr double kScanMmPerS = 40.0;

Kind kind_of(Motion motion) {
  switch (motion) {
    case Motion::kPress:
      return Kind::kPress;
    case Motion::kTap:
    case Motion::kStrikeFree:
      return Kind::kTap;
    case Motion::kLightTaps:
      return Kind::kScan;
    case Motion::kStroke:
      return Kind::kStroke;
    case Motion::kSway:
      return Kind::kSway;
    case Motion::kRest:
      break;
  }
  return Kind::kRest;
}

}  // namespace

SimulatedMotion simulated_motion(const identification::MotionRequest& request) {
  SimulatedMotion motion;
  sim::HandProgram& hand = motion.program;
  hand.kind = kind_of(request.motion);
  hand.tilt_deg = request.tilt_deg;
  hand.place_mm = request.place_mm;
  hand.travel_s = kTravelS;
  hand.repetitions = std::max(1, request.repetitions);
  if (request.force_n > 0.0) hand.force_n = request.force_n;
  if (request.motion == Motion::kPress && request.displacement_mm > 0.0) {
    // To a depth, over one place: with a firm grip (D§5.4), or the hand yields before it gets there.
    hand.depth_mm = request.displacement_mm;
    hand.grip_stiffness_scale = kFirmGrip;
    hand.grip_damping_scale = kFirmGripDamping;
  }
  if (request.force_rate_n_per_s > 0.0) hand.force_rate_n_per_s = request.force_rate_n_per_s;
  if (request.speed_mm_per_s > 0.0) hand.speed_mm_per_s = request.speed_mm_per_s;
  if (request.length_mm > 0.0) hand.stroke_length_mm = request.length_mm;
  hand.hold_s = std::max(0.0, request.hold_s);
  hand.approach_mm_per_s = 40.0;
  double posture_s = 0.0;
  switch (request.motion) {
    case Motion::kStroke:
      hand.place_mm.x += 0.5 * hand.stroke_length_mm;  // the hand strokes about its home
      break;
    case Motion::kLightTaps:
      if (!(request.speed_mm_per_s > 0.0)) hand.speed_mm_per_s = kScanMmPerS;
      break;
    case Motion::kStrikeFree:
      hand.place_mm.z = std::max(hand.place_mm.z, kFreeHeightMm);
      break;
    case Motion::kSway:
      if (!(request.speed_mm_per_s > 0.0)) hand.speed_mm_per_s = kSwayMmPerS;
      if (!(request.tilt_deg > 0.0)) hand.tilt_deg = kSwayTiltDeg;
      hand.rate_hz = kSwayHz;
      hand.place_mm.z = std::max(hand.place_mm.z, kFreeHeightMm);
      hand.hold_s = std::max(1.0, request.hold_s);
      break;
    case Motion::kRest:
      posture_s = std::max(1.0, request.hold_s);
      break;
    case Motion::kPress:
    case Motion::kTap:
      break;
  }
  motion.duration_s = sim::planned_duration_s(hand) + posture_s;
  return motion;
}

}  // namespace hapticd::server
