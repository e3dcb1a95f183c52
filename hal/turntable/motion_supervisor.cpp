#include "hal/turntable/motion_supervisor.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <string>
#include <utility>

#include "hal/turntable/trapezoid.h"

namespace hapticd::turntable {

namespace {

constexpr double kArrivalFactor = 1.5;
/// A drive that is homed already may take this long before it shows that it homes again.
constexpr double kHomingGraceS = 1.0;
/// Homing stops at switches and turns round.
constexpr double kHomingTimeout = 4.0;
/// The drive's own position does not change by more than a share of the tolerance for this long: it is at
/// rest.
constexpr double kRestS = 0.15;
constexpr double kRestShare = 0.2;

std::string text(const char* format, double a, double b = 0.0) {
  char line[160];
  std::snprintf(line, sizeof line, format, a, b);
  return line;
}

}  // namespace

void MotionSupervisor::begin(double now_s, double from_deg, hal::MotionKind kind) {
  const std::uint64_t number = report_.number + 1;
  report_ = hal::MotionReport{};
  report_.number = number;
  report_.kind = kind;
  report_.end = hal::MotionEnd::kUnderWay;
  began_s_ = progress_s_ = rest_s_ = now_s;
  from_deg_ = progress_deg_ = rest_deg_ = from_deg;
  settling_since_s_.reset();
  stop_refusal_.reset();
  home_seen_to_begin_ = false;
}

void MotionSupervisor::begin_move(double now_s, double from_deg, double target_deg,
                                  const hal::MotionLimits& limits) {
  begin(now_s, from_deg, hal::MotionKind::kMove);
  report_.target_deg = target_deg;
  report_.expected_s =
      trapezoid_duration_s(target_deg - from_deg, limits.speed_deg_per_s, limits.acceleration_deg_per_s2);
  timeout_s_ = kArrivalFactor * report_.expected_s + settings_.arrival_margin_s;
  // However slow the motion, no stall is reported before the drive could have made twice the distance that
  // counts.
  stall_window_s_ = settings_.stall_after_s + 2.0 * settings_.stall_distance_deg / limits.speed_deg_per_s +
                    2.0 * std::sqrt(settings_.stall_distance_deg / limits.acceleration_deg_per_s2);
}

void MotionSupervisor::begin_home(double now_s, double from_deg) {
  begin(now_s, from_deg, hal::MotionKind::kHome);
  timeout_s_ = settings_.homing_timeout_s;
  stall_window_s_ = kHomingTimeout * settings_.stall_after_s;
}

void MotionSupervisor::end(double now_s, hal::MotionEnd end) {
  report_.end = end;
  report_.stopping = false;
  report_.elapsed_s = now_s - began_s_;
  if (end == hal::MotionEnd::kArrived) report_.completion = 1.0;
}

void MotionSupervisor::abandon(double now_s, hal::MotionEnd how, hal::Error problem) {
  if (!under_way()) return;
  if (!report_.problem) report_.problem = std::move(problem);
  end(now_s, how);
}

MotionSupervisor::Action MotionSupervisor::stop(double now_s, hal::MotionEnd how,
                                                std::optional<hal::Error> problem) {
  if (!under_way() || report_.stopping) return Action::kNone;
  report_.stopping = true;
  report_.problem = std::move(problem);
  stop_end_ = how;
  stop_sent_s_ = rest_s_ = now_s;
  return Action::kSendStop;
}

void MotionSupervisor::stop_answered(double now_s, std::optional<hal::Error> refusal) {
  // Its time to come to rest counts from when the drive takes the stop.
  if (stop_refusal_ && !refusal) stop_sent_s_ = now_s;
  stop_refusal_ = std::move(refusal);
}

bool MotionSupervisor::stands(double now_s, const DriveReading& reading) const noexcept {
  return !reading.moving.value_or(false) && now_s - rest_s_ >= kRestS;
}

MotionSupervisor::Action MotionSupervisor::observe(double now_s, const DriveReading& reading) {
  if (!under_way()) return Action::kNone;
  report_.elapsed_s = now_s - began_s_;
  const double position = reading.position_deg;
  if (std::abs(position - progress_deg_) >= settings_.stall_distance_deg) {
    progress_deg_ = position;
    progress_s_ = now_s;
  }
  if (std::abs(position - rest_deg_) > kRestShare * settings_.tolerance_deg) {
    rest_deg_ = position;
    rest_s_ = now_s;
  }
  if (report_.target_deg && *report_.target_deg != from_deg_) {
    report_.completion = std::clamp((position - from_deg_) / (*report_.target_deg - from_deg_), 0.0, 1.0);
  }
  if (reading.alarm.value_or(false)) {
    // The drive has stopped itself and takes no orders.
    abandon(now_s, hal::MotionEnd::kAlarm,
            {"the drive raised an alarm", "turntable", text("code %.0f", reading.alarm_code), "",
             "fix the cause, then clear the alarm"});
    return Action::kNone;
  }
  if (report_.stopping) return observe_stopping(now_s, reading);
  return report_.kind == hal::MotionKind::kHome ? observe_home(now_s, reading) : observe_move(now_s, reading);
}

MotionSupervisor::Action MotionSupervisor::observe_stopping(double now_s, const DriveReading& reading) {
  if (stands(now_s, reading)) {
    end(now_s, stop_end_);
  } else if (now_s - stop_sent_s_ > settings_.stop_timeout_s) {
    hal::Error still{"the table was asked to stop but still moves", "turntable",
                     text("%.3f deg", reading.position_deg),
                     text("to stand within %.1f s", settings_.stop_timeout_s),
                     "cut the drive's power, then look at its stop order in the register map"};
    if (stop_refusal_) {
      still.what = "the table still moves: the drive has not taken the stop";
      still.value += "; " + stop_refusal_->text();
      still.remedy = "cut the drive's power; the stop is repeated until the drive takes it";
    }
    if (report_.problem) still.what = report_.problem->what + "; " + still.what;
    report_.problem = std::move(still);
    end(now_s, stop_end_);
  }
  return Action::kNone;
}

MotionSupervisor::Action MotionSupervisor::observe_move(double now_s, const DriveReading& reading) {
  const double target = *report_.target_deg;
  const bool near = std::abs(reading.position_deg - target) <= settings_.tolerance_deg;
  const bool done = !reading.moving.value_or(false) && reading.in_position.value_or(true);
  if (!reading.homed.value_or(true)) {
    return stop(now_s, hal::MotionEnd::kLost,
                hal::Error{"the drive lost its homing on the way: where the table stands is not known",
                           "turntable", "", "", "see whether its power failed, then home the table"});
  }
  if (near && done) {
    if (!settling_since_s_) settling_since_s_ = now_s;
    if (now_s - *settling_since_s_ >= settings_.settle_s) end(now_s, hal::MotionEnd::kArrived);
    return Action::kNone;
  }
  settling_since_s_.reset();
  const std::string distance = text("at %.3f deg, target %.3f deg", reading.position_deg, target);
  if (now_s - progress_s_ > stall_window_s_ && !near) {
    if (reading.in_position.value_or(false) && !reading.moving.value_or(false)) {
      return stop(now_s, hal::MotionEnd::kMissed,
                  hal::Error{"the drive says that it has arrived, but stands elsewhere", "turntable",
                             distance, text("within %.3f deg", settings_.tolerance_deg),
                             "check scale, gear and limits of the drive; home the table"});
    }
    return stop(now_s, hal::MotionEnd::kStalled,
                hal::Error{"the table does not move although it was asked to", "turntable", distance,
                           text("progress within %.2f s", stall_window_s_),
                           "free the table, see whether the drive is enabled, then clear the stall"});
  }
  if (now_s - began_s_ > timeout_s_) {
    return stop(now_s, hal::MotionEnd::kTimedOut,
                hal::Error{near ? "the table is at its target, but the drive never said so"
                                : "the table did not arrive in time",
                           "turntable", distance, text("%.2f s", timeout_s_),
                           near ? "check the bits 'moving' and 'in_position' of the register map"
                                : "see what slows it down, or allow lower limits"});
  }
  return Action::kNone;
}

MotionSupervisor::Action MotionSupervisor::observe_home(double now_s, const DriveReading& reading) {
  const bool homed = reading.homed.value_or(false);
  if (!homed || reading.moving.value_or(false)) home_seen_to_begin_ = true;
  const bool begun = home_seen_to_begin_ || now_s - began_s_ > kHomingGraceS;
  if (homed && begun && stands(now_s, reading)) {
    end(now_s, hal::MotionEnd::kArrived);
    return Action::kNone;
  }
  if (now_s - began_s_ > timeout_s_) {
    return stop(now_s, hal::MotionEnd::kTimedOut,
                hal::Error{"the table was not homed in time", "turntable", "", text("%.1f s", timeout_s_),
                           "check the home switch and the homing speed"});
  }
  if (now_s - progress_s_ > stall_window_s_ && !homed) {
    return stop(
        now_s, hal::MotionEnd::kStalled,
        hal::Error{"the table does not move although it was asked to home", "turntable",
                   text("at %.3f deg", reading.position_deg), text("progress within %.2f s", stall_window_s_),
                   "free the table, see whether the drive is enabled, then clear the stall"});
  }
  return Action::kNone;
}

}  // namespace hapticd::turntable
