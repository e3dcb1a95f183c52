#include "hal/turntable/driven_turntable.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <thread>
#include <utility>

#include "hal/turntable/turntable_state.h"

namespace hapticd::turntable {

namespace {

using Clock = std::chrono::steady_clock;
using hal::MotionEnd;
using hal::TurntableState;

}  // namespace

TurntableState DrivenTurntable::State::state_locked() const {
  if (!engaged) return TurntableState::kIdle;
  if (!reported_once) return TurntableState::kConnecting;
  if (age_locked() > age_limit_locked()) return TurntableState::kLost;
  return drive_state;
}

std::optional<hal::Error> DrivenTurntable::State::refusal_locked(bool needs_homed) const {
  const TurntableState state = state_locked();
  hal::Error error{"", "turntable", hal::word_of(state), "", ""};
  if (state == TurntableState::kIdle) return not_engaged();
  if (busy_locked()) {
    error.what = "another motion is under way";
    error.remedy = "wait until it has ended, or stop it";
  } else if (state == TurntableState::kConnecting || age_locked() > settings.stale_after_s) {
    error.what = "the table's position is not known: it does not turn without a fresh one";
    error.limit = "not older than " + number(settings.stale_after_s, "s");
    error.remedy = link_error ? link_error->text() : "wait until the drive answers";
  } else if (state == TurntableState::kAlarm) {
    error.what = "the drive reports an alarm";
    error.value = "code " + std::to_string(reading.alarm_code) + ", " + drive->alarm_text(reading.alarm_code);
    error.remedy = "fix the cause, then clear the alarm";
  } else if (state == TurntableState::kStalled) {
    error.what = "the table has stalled";
    error.remedy = "free it, then clear the stall";
  } else if (state == TurntableState::kMoving || state == TurntableState::kHoming) {
    error.what = "the table turns already, though not by an order from here";
    error.remedy = "wait until it stands, or stop it";
  } else if (needs_homed && state == TurntableState::kNotHomed) {
    error.what = "the table is not homed: the drive does not know where it is";
    error.remedy = "home it first";
  } else {
    return std::nullopt;
  }
  return error;
}

hal::Result<std::uint64_t> DrivenTurntable::State::order(
    bool needs_homed, std::optional<std::pair<double, hal::MotionLimits>> move) {
  if (auto why_not = permitted()) return *why_not;
  const MutexLock lock(mutex);
  if (auto error = refusal_locked(needs_homed)) return *error;
  orders.home = !move;
  orders.move = std::move(move);
  ordered = motion.number + 1;
  wake.notify_all();
  return ordered;
}

DrivenTurntable::DrivenTurntable(std::string name, const TurntableSettings& settings,
                                 std::unique_ptr<Drive> drive)
    : state_(std::make_unique<State>(std::move(name), settings, std::move(drive))) {}

DrivenTurntable::~DrivenTurntable() {
  disengage();
}

const hal::TurntableInfo& DrivenTurntable::info() const noexcept {
  return state_->info;
}

std::optional<hal::Error> DrivenTurntable::engage() {
  State& s = *state_;
  MutexLock engaging(s.engage_mutex);
  {
    const MutexLock lock(s.mutex);
    if (s.engaged) return std::nullopt;
    s.engaged = true;
    s.leave = s.reported_once = false;
    s.orders = {};
    s.is_busy = false;
    s.link_error.reset();
    s.order_error.reset();
  }
  s.pause_s = 0.0;
  s.failures_in_a_row = 0;
  s.last_reading.reset();
  s.stop_is_due = false;
  s.repeated.reset();
  s.thread = std::thread([&s] { s.run(); });

  std::optional<hal::Error> problem;
  {
    const MutexLock lock(s.mutex);
    const auto until = Clock::now() + std::chrono::ceil<Clock::duration>(
                                          std::chrono::duration<double>(s.settings.engage_timeout_s));
    while (!s.reported_once && s.changed.wait_until(s.mutex, until)) {
    }
    if (s.reported_once) return std::nullopt;
    problem = s.link_error;
  }
  engaging.unlock();
  disengage();
  if (problem) return problem;
  return hal::Error{"the drive reported no position in time", "turntable, " + s.drive->connection(), "",
                    number(s.settings.engage_timeout_s, "s"), "check power, address and unit of the drive"};
}

void DrivenTurntable::disengage() noexcept {
  State& s = *state_;
  const MutexLock engaging(s.engage_mutex);
  {
    const MutexLock lock(s.mutex);
    s.leave = true;
  }
  s.wake.notify_all();
  if (s.thread.joinable()) s.thread.join();
  const MutexLock lock(s.mutex);
  s.engaged = false;
  s.reported_once = false;
  s.ordered = s.motion.number;
}

hal::TurntableStatus DrivenTurntable::status() const {
  const State& s = *state_;
  const MutexLock lock(s.mutex);
  hal::TurntableStatus status;
  status.state = s.state_locked();
  status.motion = s.motion;
  status.position_age_s = s.age_locked();
  if (!s.reported_once) return status;
  status.position_deg = s.reading.position_deg;
  status.homed = s.reading.homed.value_or(false);
  const bool fresh = status.state != TurntableState::kLost;
  if (fresh) status.velocity_deg_per_s = s.velocity_deg_per_s;
  status.alarm_code = s.reading.alarm_code;
  if (s.reading.alarm.value_or(false)) status.alarm_text = s.drive->alarm_text(s.reading.alarm_code);
  if (status.state == TurntableState::kStanding) {
    for (const hal::TurntableStation& station : s.info.stations) {
      if (std::abs(station.angle_deg - s.reading.position_deg) <= s.info.tolerance_deg)
        status.station = station.name;
    }
  }
  return status;
}

hal::PartReport DrivenTurntable::report() const {
  const hal::TurntableStatus now = status();
  const State& s = *state_;
  hal::PartReport report;
  report.part = "turntable";
  report.driver = s.drive->driver();
  report.connection = s.drive->connection();
  report.figures = s.drive->figures();
  switch (now.state) {
    case TurntableState::kIdle:
      report.state = hal::PartState::kIdle;
      break;
    case TurntableState::kConnecting:
    case TurntableState::kLost:
      report.state = hal::PartState::kConnecting;
      break;
    case TurntableState::kStalled:
    case TurntableState::kAlarm:
      report.state = hal::PartState::kFaulty;
      break;
    default:
      report.state = hal::PartState::kReady;
  }
  const MutexLock lock(s.mutex);
  if (now.state == TurntableState::kAlarm) {
    report.findings.push_back("alarm " + std::to_string(now.alarm_code) + ", " + now.alarm_text +
                              "; fix the cause, then clear the alarm");
  }
  if (now.state == TurntableState::kNotHomed)
    report.findings.emplace_back("not homed; home it before it is moved");
  if (now.state == TurntableState::kStalled)
    report.findings.emplace_back("stalled; free the table, then clear the stall");
  if (s.link_error) report.findings.push_back(s.link_error->text());
  if (s.order_error) report.findings.push_back(s.order_error->text());
  report.figures.push_back({"polls", static_cast<double>(s.polls), ""});
  report.figures.push_back({"failed_polls", static_cast<double>(s.failures), ""});
  report.figures.push_back({"implausible_positions", static_cast<double>(s.rejected), ""});
  report.figures.push_back({"connection_attempts", static_cast<double>(s.connects), ""});
  if (s.reported_once) report.figures.push_back({"position_age", now.position_age_s, "s"});
  return report;
}

void DrivenTurntable::set_permit(hal::MotionPermit permit) {
  const MutexLock lock(state_->mutex);
  state_->permit = std::move(permit);
}

hal::Result<std::uint64_t> DrivenTurntable::home() {
  return state_->order(false, std::nullopt);
}

hal::Result<std::uint64_t> DrivenTurntable::move_to(double angle_deg, const hal::MotionLimits& limits) {
  const State& s = *state_;
  if (!(angle_deg >= s.settings.min_deg && angle_deg <= s.settings.max_deg)) {
    const bool is_finite = std::isfinite(angle_deg);
    return hal::Error::of(is_finite ? hal::ErrorCode::kOutOfRange : hal::ErrorCode::kNotFinite,
                          is_finite ? "the angle is out of the table's range" : "the angle is not finite",
                          "angle_deg", number(angle_deg, "deg"), range_text(s.settings),
                          "choose an angle in the range");
  }
  const auto checked = [](double wanted, double most, const char* where, const char* unit,
                          double& granted) -> std::optional<hal::Error> {
    granted = wanted == 0.0 ? most : wanted;
    if (granted > 0.0 && granted <= most) return std::nullopt;
    return hal::Error::of(hal::ErrorCode::kOutOfRange, "the limit of the motion is out of range", where,
                          number(wanted, unit), "above 0, at most " + number(most, unit),
                          "choose a value in the range");
  };
  hal::MotionLimits granted;
  if (auto error = checked(limits.speed_deg_per_s, s.settings.speed_deg_per_s, "speed_deg_per_s", "deg/s",
                           granted.speed_deg_per_s)) {
    return *error;
  }
  if (auto error = checked(limits.acceleration_deg_per_s2, s.settings.acceleration_deg_per_s2,
                           "acceleration_deg_per_s2", "deg/s²", granted.acceleration_deg_per_s2)) {
    return *error;
  }
  return state_->order(true, std::pair{angle_deg, granted});
}

void DrivenTurntable::stop() {
  {
    const MutexLock lock(state_->mutex);
    if (!state_->engaged) return;
    state_->orders.stop = true;
  }
  state_->wake.notify_all();
}

std::optional<hal::Error> DrivenTurntable::clear_alarm() {
  {
    const MutexLock lock(state_->mutex);
    if (!state_->engaged) return not_engaged();
    if (state_->busy_locked()) {
      return hal::Error{"a motion is under way", "turntable", "", "", "stop it first"};
    }
    state_->orders.clear = true;
  }
  state_->wake.notify_all();
  return std::nullopt;
}

}  // namespace hapticd::turntable
