#include <pthread.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "hal/turntable/turntable_state.h"

namespace hapticd::turntable {

namespace {

using Clock = std::chrono::steady_clock;
using hal::MotionEnd;
using hal::TurntableState;

/// How often the permit is asked while the table turns.
constexpr std::chrono::milliseconds kPermitPeriod{2};
/// Number of failures in a row after which the connection is opened again.
constexpr int kFailuresInARow = 3;
/// A position that is beyond the range by more than this is not believed.
constexpr double kPlausibleBeyondDeg = 360.0;
/// Bound of a position before homing: it counts from anywhere.
constexpr double kPlausibleUnhomedDeg = 36000.0;
/// A reading may be ahead of the last one by this much more than the greatest speed explains.
constexpr double kJumpFactor = 3.0;
constexpr double kJumpSlackDeg = 5.0;
/// Time over which the velocity of a drive that reports none is taken from its positions.
constexpr double kVelocitySmoothingS = 0.1;

hal::TurntableInfo info_of(std::string name, const TurntableSettings& settings) {
  hal::TurntableInfo info;
  info.name = std::move(name);
  info.min_deg = settings.min_deg;
  info.max_deg = settings.max_deg;
  info.limits = {settings.speed_deg_per_s, settings.acceleration_deg_per_s2};
  info.tolerance_deg = settings.supervision.tolerance_deg;
  info.stale_after_s = settings.stale_after_s;
  info.stations = settings.stations;
  return info;
}

}  // namespace

DrivenTurntable::State::State(std::string name, const TurntableSettings& given,
                              std::unique_ptr<Drive> its_drive)
    : settings(given),
      info(info_of(std::move(name), given)),
      drive(std::move(its_drive)),
      supervisor(given.supervision) {}

void DrivenTurntable::State::run() {
  pthread_setname_np(pthread_self(), "turntable");
  next_attempt = next_poll = Clock::now();
  for (;;) {
    Orders taken;
    {
      const auto until = wake_time();
      const MutexLock lock(mutex);
      while (!leave && !orders.any() && wake.wait_until(mutex, until)) {
      }
      if (leave) break;
      std::swap(taken, orders);
    }
    perform(taken);
    ask_permit();
    if (!drive->linked()) {
      if (Clock::now() >= next_attempt) connect();
    } else if (Clock::now() >= next_poll) {
      poll();
      next_poll = std::max(next_poll + period(), Clock::now());
    }
    watch_age();
    publish();
  }
  if (drive->linked()) {
    const double began = now_s();
    if (stop_is_due || supervisor.under_way() || (last_reading && last_reading->moving.value_or(false))) {
      while (drive->stop() && drive->linked() && now_s() - began < settings.busy_timeout_s)
        std::this_thread::sleep_for(period());
    }
    drive->close();
  }
  supervisor.abandon(now_s(), MotionEnd::kStopped,
                     {"the turntable was disengaged", "turntable", "", "", "engage it again"});
  publish();
}

Clock::time_point DrivenTurntable::State::wake_time() const {
  const auto due = drive->linked() ? next_poll : next_attempt;
  if (!supervisor.under_way() || supervisor.stopping()) return due;
  return std::min(due, Clock::now() + kPermitPeriod);
}

void DrivenTurntable::State::lose_link(const hal::Error& why) {
  drive->close();
  failures_in_a_row = 0;
  pause_s = settings.reconnect_after_s;
  next_attempt =
      Clock::now() + std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(pause_s));
  last_reading.reset();
  // A motion that the drive has not begun is not begun after a break.
  if (repeated && !repeated->order.clear) refuse(why);
  repeated.reset();
  const MutexLock lock(mutex);
  is_busy = false;
  link_error = why;
}

void DrivenTurntable::State::connect() {
  auto error = drive->open();
  {
    const MutexLock lock(mutex);
    ++connects;
    if (error) link_error = error;
  }
  if (!error) {
    next_poll = Clock::now();
    safety_stop_sent = false;
    return;
  }
  drive->close();
  pause_s =
      pause_s == 0.0 ? settings.reconnect_after_s : std::min(2.0 * pause_s, settings.reconnect_longest_s);
  next_attempt =
      Clock::now() + std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(pause_s));
}

void DrivenTurntable::State::poll() {
  repeat_orders();
  auto answer = drive->read();
  const double now = now_s();
  {
    const MutexLock lock(mutex);
    ++polls;
  }
  std::optional<hal::Error> problem;
  if (!answer) {
    problem = answer.error();
  } else {
    problem = implausible(*answer, now);
    const MutexLock lock(mutex);
    if (problem) ++rejected;
  }
  const bool busy = problem && problem->code == hal::ErrorCode::kBusy;
  {
    const MutexLock lock(mutex);
    is_busy = busy;
    if (problem) {
      ++failures;
      link_error = problem;
    }
  }
  if (busy) {
    failures_in_a_row = 0;  // the link is in order
    return;
  }
  if (problem) {
    if (++failures_in_a_row >= kFailuresInARow || !drive->linked()) lose_link(*problem);
    return;
  }
  failures_in_a_row = 0;
  pause_s = 0.0;
  accept(*answer, now);
}

std::optional<hal::Error> DrivenTurntable::State::implausible(const DriveReading& candidate,
                                                              double now) const {
  hal::Error error;
  error.where = "turntable, position";
  error.value = number(candidate.position_deg, "deg");
  if (!std::isfinite(candidate.position_deg)) {
    error.what = "the drive's position is not a number";
    const std::string hint = drive->hint_for_implausible();
    error.remedy =
        hint.empty() ? "check type, address and word order of 'position_actual' in the register map" : hint;
    return error;
  }
  const double beyond =
      std::max(settings.min_deg - candidate.position_deg, candidate.position_deg - settings.max_deg);
  if (beyond > (candidate.homed.value_or(false) ? kPlausibleBeyondDeg : kPlausibleUnhomedDeg)) {
    error.what = "the drive's position is implausible";
    error.limit = range_text(settings) + ", and a turn beyond";
    const std::string hint = drive->hint_for_implausible();
    error.remedy =
        hint.empty() ? "check word order, scale and unit of 'position_actual' in the register map" : hint;
    return error;
  }
  const bool homing = supervisor.under_way() && supervisor.report().kind == hal::MotionKind::kHome;
  if (last_reading && !homing) {
    const double explained = kJumpFactor * settings.speed_deg_per_s * (now - last_reading_s) + kJumpSlackDeg;
    const double jump = std::abs(candidate.position_deg - last_reading->position_deg);
    if (jump > explained) {
      error.what = "the drive's position jumped";
      error.value = number(last_reading->position_deg, "deg, then") + " " + error.value;
      error.limit = number(explained, "deg in that time");
      error.remedy = "if it stays there, the drive was restarted: it is read again, and has to be homed";
      return error;
    }
  }
  return std::nullopt;
}

double DrivenTurntable::State::velocity_of(const DriveReading& next, double now) const {
  if (next.velocity_deg_per_s && std::isfinite(*next.velocity_deg_per_s)) return *next.velocity_deg_per_s;
  if (!last_reading || now <= last_reading_s) return 0.0;
  const double dt = now - last_reading_s;
  const double raw = (next.position_deg - last_reading->position_deg) / dt;
  const double share = 1.0 - std::exp(-dt / kVelocitySmoothingS);
  const MutexLock lock(mutex);
  return velocity_deg_per_s + share * (raw - velocity_deg_per_s);
}

void DrivenTurntable::State::accept(const DriveReading& next, double now) {
  const double velocity = velocity_of(next, now);
  last_reading = next;
  last_reading_s = now;
  {
    const MutexLock lock(mutex);
    link_error.reset();
    reading = next;
    velocity_deg_per_s = velocity;
    reading_s = now;
    reported_once = true;
    drive_state = state_of(next);
  }
  if (supervisor.observe(now, next) == MotionSupervisor::Action::kSendStop) send_stop();
  // Whatever it does that was not requested here, e.g. what was begun before contact was lost, is ended.
  const bool automatic = next.moving.value_or(false) && !supervisor.under_way();
  if (automatic && !safety_stop_sent) send_stop();
  safety_stop_sent = automatic;
  if (!supervisor.under_way() && next.moving == false) stop_is_due = false;
}

void DrivenTurntable::State::send_stop() {
  repeated.reset();
  const bool is_repetition = std::exchange(stop_is_due, true);
  if (!drive->linked()) return;
  // One more try at once: of all orders this is the one that must arrive.
  auto error = drive->stop();
  if (error && error->code != hal::ErrorCode::kBusy && drive->linked()) error = drive->stop();
  stop_is_due = error.has_value();
  supervisor.stop_answered(now_s(), error);
  const MutexLock lock(mutex);
  if (error) {
    ++failures;
    order_error = error;
  } else if (is_repetition) {
    order_error.reset();
  }
}

void DrivenTurntable::State::repeat_orders() {
  if (stop_is_due) send_stop();
  if (!repeated) return;
  const RepeatedOrder again = *repeated;
  if (!again.order.clear) {
    if (!supervisor.under_way() || supervisor.stopping()) return repeated.reset();
    supervisor.postpone(now_s());
  }
  send(again.order, again.since_s);
}

std::optional<hal::Error> DrivenTurntable::State::permitted() {
  hal::MotionPermit asked;
  {
    const MutexLock lock(mutex);
    asked = permit;
  }
  return asked ? asked() : std::nullopt;
}

void DrivenTurntable::State::watch_age() {
  if (!supervisor.under_way()) return;
  double last = 0.0;
  double limit = 0.0;
  bool busy = false;
  hal::Error why;
  {
    const MutexLock lock(mutex);
    last = reading_s;
    limit = age_limit_locked();
    busy = is_busy;
    if (link_error) why = *link_error;
  }
  const double age = now_s() - last;
  if (age <= limit) return;
  send_stop();
  hal::Error lost{std::string(busy ? "the drive was busy for too long on the way"
                                   : "contact with the drive was lost on the way") +
                      ": where the table stands is not known",
                  "turntable", "no usable position for " + number(age, "s"), number(limit, "s"),
                  "look at the table; the drive may go on by itself until contact is back"};
  if (!why.what.empty()) lost.value += "; " + why.text();
  supervisor.abandon(now_s(), MotionEnd::kLost, std::move(lost));
}

void DrivenTurntable::State::refuse(const hal::Error& why) {
  supervisor.abandon(now_s(), MotionEnd::kRefused, why);
  const MutexLock lock(mutex);
  order_error = why;
}

void DrivenTurntable::State::perform(const Orders& wanted) {
  if (wanted.stop) {
    if (supervisor.under_way()) {
      stop_motion(MotionEnd::kStopped,
                  hal::Error{"the motion was stopped", "turntable", "", "", "begin another one"});
    } else {
      send_stop();
    }
  }
  if (wanted.clear && drive->linked()) {
    Orders clear;
    clear.clear = true;
    send(clear, now_s());
    const MutexLock lock(mutex);
    stalled = false;
  }
  if (wanted.home || wanted.move) begin(wanted);
}

void DrivenTurntable::State::begin(const Orders& wanted) {
  const double from = last_reading ? last_reading->position_deg : 0.0;
  const double now = now_s();
  if (wanted.move) {
    supervisor.begin_move(now, from, wanted.move->first, wanted.move->second);
  } else {
    supervisor.begin_home(now, from);
  }
  if (!drive->linked() || !last_reading) {
    return refuse({"there is no connection to the drive", "turntable", "", "", "wait until it is back"});
  }
  if (wanted.stop) {
    return supervisor.abandon(now, MotionEnd::kStopped,
                              {"the motion was stopped", "turntable", "", "", "begin another one"});
  }
  if (auto why_not = permitted()) {
    return supervisor.abandon(now, MotionEnd::kForbidden, *why_not);
  }
  stop_is_due = false;
  Orders start;
  start.home = wanted.home;
  start.move = wanted.move;
  send(start, now);
  next_poll = Clock::now();
}

void DrivenTurntable::State::send(const Orders& order, double since_s) {
  const auto error = order.clear  ? drive->reset_alarm()
                     : order.move ? drive->start_move(order.move->first, order.move->second)
                                  : drive->start_home();
  if (error && error->code == hal::ErrorCode::kBusy && now_s() - since_s < settings.busy_timeout_s) {
    repeated = RepeatedOrder{order, since_s};
  } else {
    repeated.reset();
    if (error && !order.clear) {
      // Part of it may have been taken.
      send_stop();
      return refuse(*error);
    }
  }
  const MutexLock lock(mutex);
  order_error = error;
}

TurntableState DrivenTurntable::State::state_of(const DriveReading& now) const {
  if (now.alarm.value_or(false)) return TurntableState::kAlarm;
  if (supervisor.under_way()) {
    return supervisor.report().kind == hal::MotionKind::kHome ? TurntableState::kHoming
                                                              : TurntableState::kMoving;
  }
  if (stalled) return TurntableState::kStalled;
  if (now.moving.value_or(false)) return TurntableState::kMoving;
  return now.homed.value_or(false) ? TurntableState::kStanding : TurntableState::kNotHomed;
}

void DrivenTurntable::State::publish() {
  {
    const MutexLock lock(mutex);
    const bool ended = motion.end == MotionEnd::kUnderWay && !supervisor.under_way();
    motion = supervisor.report();
    if (ended && motion.end == MotionEnd::kStalled) stalled = true;
    drive_state = state_of(reading);
  }
  changed.notify_all();
}

}  // namespace hapticd::turntable
