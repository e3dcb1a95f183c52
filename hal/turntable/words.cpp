#include "hal/turntable.h"

namespace hapticd::hal {

const char* word_of(TurntableState state) noexcept {
  switch (state) {
    case TurntableState::kIdle:
      return "idle";
    case TurntableState::kConnecting:
      return "connecting";
    case TurntableState::kNotHomed:
      return "not_homed";
    case TurntableState::kHoming:
      return "homing";
    case TurntableState::kStanding:
      return "standing";
    case TurntableState::kMoving:
      return "moving";
    case TurntableState::kStalled:
      return "stalled";
    case TurntableState::kAlarm:
      return "alarm";
    case TurntableState::kLost:
      return "lost";
  }
  return "unknown";
}

const char* word_of(MotionEnd end) noexcept {
  switch (end) {
    case MotionEnd::kNone:
      return "none";
    case MotionEnd::kUnderWay:
      return "under_way";
    case MotionEnd::kArrived:
      return "arrived";
    case MotionEnd::kStopped:
      return "stopped";
    case MotionEnd::kForbidden:
      return "forbidden";
    case MotionEnd::kTimedOut:
      return "timed_out";
    case MotionEnd::kStalled:
      return "stalled";
    case MotionEnd::kMissed:
      return "missed";
    case MotionEnd::kAlarm:
      return "alarm";
    case MotionEnd::kLost:
      return "lost";
    case MotionEnd::kRefused:
      return "refused";
  }
  return "unknown";
}

}  // namespace hapticd::hal
