#include "hal/turntable/driven_turntable.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <condition_variable>
#include <cstdio>
#include <mutex>
#include <thread>
#include <utility>

namespace hapticd::turntable {

namespace {

using Clock = std::chrono::steady_clock;
using hal::MotionEnd;
using hal::TurntableState;

/// How often the permit is asked while the table turns.
constexpr std::chrono::milliseconds kPermitPeriod{2};
/// So many failures in a row, and the connection is opened again.
constexpr int kFailuresInARow = 3;
/// Beyond its range by more than this, a position is no position.
constexpr double kPlausibleBeyondDeg = 360.0;
/// Before it is homed it counts from anywhere.
constexpr double kPlausibleUnhomedDeg = 36000.0;
/// A reading may be ahead of the last one by this much more than the greatest speed explains.
constexpr double kJumpFactor = 3.0;
constexpr double kJumpSlackDeg = 5.0;
/// Without a velocity of its own, a drive's is taken from its positions over this time.
constexpr double kVelocitySmoothingS = 0.1;

std::string number(double value, const char* unit) {
  char text[64];
  std::snprintf(text, sizeof text, "%.6g %s", value, unit);
  return text;
}

std::string range_text(const TurntableSettings& settings) {
  return number(settings.min_deg, "…") + " " + number(settings.max_deg, "deg");
}

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

hal::Error not_engaged() {
  return {"the turntable is not engaged", "turntable", "", "", "engage it first"};
}

}  // namespace

std::optional<hal::Error> check(const TurntableSettings& settings) {
  if (!(settings.min_deg < settings.max_deg)) {
    return hal::Error{"the turntable has no range", "[rig.turntable] min_deg, max_deg", range_text(settings),
                      "min_deg < max_deg", "correct them"};
  }
  if (!(settings.stale_after_s * settings.poll_hz >= 2.0)) {
    return hal::Error{"the position would be stale between two polls", "[rig.turntable] stale_after_s",
                      number(settings.stale_after_s, "s"),
                      "at least " + number(2.0 / settings.poll_hz, "s") + " at this poll_hz",
                      "poll faster or allow an older position"};
  }
  for (std::size_t i = 0; i < settings.stations.size(); ++i) {
    const hal::TurntableStation& station = settings.stations[i];
    const std::string where = "[rig.turntable.stations." + station.name + "] angle_deg";
    if (!(station.angle_deg >= settings.min_deg && station.angle_deg <= settings.max_deg)) {
      return hal::Error{"the station lies beyond the table's range", where, number(station.angle_deg, "deg"),
                        range_text(settings), "correct the angle or the range"};
    }
    for (std::size_t j = 0; j < i; ++j) {
      if (std::abs(settings.stations[j].angle_deg - station.angle_deg) <=
          2.0 * settings.supervision.tolerance_deg) {
        return hal::Error{"two stations cannot be distinguished", where, number(station.angle_deg, "deg"),
                          "further from '" + settings.stations[j].name + "' than twice tolerance_deg",
                          "move one of them"};
      }
    }
  }
  return std::nullopt;
}

struct DrivenTurntable::State {
  State(std::string name, const TurntableSettings& given, std::unique_ptr<Drive> its_drive)
      : settings(given),
        info(info_of(std::move(name), given)),
        drive(std::move(its_drive)),
        supervisor(given.supervision) {}

  // -- set once
  const TurntableSettings settings;
  const hal::TurntableInfo info;
  const Clock::time_point epoch = Clock::now();

  // -- of the table's thread alone, while it runs
  const std::unique_ptr<Drive> drive;
  MotionSupervisor supervisor;
  int failures_in_a_row = 0;
  double pause_s = 0.0;
  Clock::time_point next_attempt{};
  Clock::time_point next_poll{};
  std::optional<DriveReading> last_reading;
  double last_reading_s = 0.0;
  bool safety_stop_sent = false;

  // -- the thread itself
  std::mutex engage_mutex;  ///< makes engaging and disengaging one after the other
  std::thread thread;

  // -- shared, under the mutex
  mutable std::mutex mutex;
  std::condition_variable wake;     ///< to the table's thread
  std::condition_variable changed;  ///< from it
  hal::MotionPermit permit;
  bool leave = false;
  struct Orders {
    bool stop = false;
    bool clear = false;
    bool home = false;
    std::optional<std::pair<double, hal::MotionLimits>> move;
    bool any() const { return stop || clear || home || move; }
  } orders;
  bool engaged = false;
  bool reported_once = false;  ///< a position since it was engaged
  bool stalled = false;
  TurntableState drive_state = TurntableState::kNotHomed;  ///< while the position is fresh
  DriveReading reading;
  double velocity_deg_per_s = 0.0;
  double reading_s = 0.0;
  hal::MotionReport motion;
  std::uint64_t ordered = 0;              ///< number of the last motion that was asked for
  std::optional<hal::Error> link_error;   ///< why there is no usable answer now
  std::optional<hal::Error> order_error;  ///< of the last order that was not taken
  std::uint64_t polls = 0, failures = 0, connects = 0, rejected = 0;

  double now_s() const { return std::chrono::duration<double>(Clock::now() - epoch).count(); }

  // ---- the table's thread -------------------------------------------------------------------------------

  void run() {
    next_attempt = next_poll = Clock::now();
    for (;;) {
      Orders taken;
      {
        std::unique_lock lock(mutex);
        const auto until = wake_time();
        wake.wait_until(lock, until, [this] { return leave || orders.any(); });
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
      if (supervisor.under_way() || (last_reading && last_reading->moving.value_or(false)))
        (void)drive->stop();
      drive->close();
    }
    supervisor.abandon(now_s(), MotionEnd::kStopped,
                       {"the turntable was disengaged", "turntable", "", "", "engage it again"});
    publish();
  }

  Clock::duration period() const {
    return std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(1.0 / settings.poll_hz));
  }

  Clock::time_point wake_time() const {
    const auto due = drive->linked() ? next_poll : next_attempt;
    if (!supervisor.under_way() || supervisor.stopping()) return due;
    return std::min(due, Clock::now() + kPermitPeriod);
  }

  void lose_link(const hal::Error& why) {
    drive->close();
    failures_in_a_row = 0;
    pause_s = settings.reconnect_after_s;
    next_attempt =
        Clock::now() + std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(pause_s));
    last_reading.reset();
    const std::lock_guard lock(mutex);
    link_error = why;
  }

  void connect() {
    auto error = drive->open();
    {
      const std::lock_guard lock(mutex);
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

  void poll() {
    auto answer = drive->read();
    const double now = now_s();
    {
      const std::lock_guard lock(mutex);
      ++polls;
    }
    std::optional<hal::Error> problem;
    if (!answer) {
      problem = answer.error();
    } else {
      problem = implausible(*answer, now);
      const std::lock_guard lock(mutex);
      if (problem) ++rejected;
    }
    if (problem) {
      {
        const std::lock_guard lock(mutex);
        ++failures;
        link_error = problem;
      }
      if (++failures_in_a_row >= kFailuresInARow || !drive->linked()) lose_link(*problem);
      return;
    }
    failures_in_a_row = 0;
    pause_s = 0.0;
    accept(*answer, now);
  }

  std::optional<hal::Error> implausible(const DriveReading& candidate, double now) const {
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
      const double explained =
          kJumpFactor * settings.speed_deg_per_s * (now - last_reading_s) + kJumpSlackDeg;
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

  double velocity_of(const DriveReading& next, double now) const {
    if (next.velocity_deg_per_s && std::isfinite(*next.velocity_deg_per_s)) return *next.velocity_deg_per_s;
    if (!last_reading || now <= last_reading_s) return 0.0;
    const double dt = now - last_reading_s;
    const double raw = (next.position_deg - last_reading->position_deg) / dt;
    const double share = 1.0 - std::exp(-dt / kVelocitySmoothingS);
    return velocity_deg_per_s + share * (raw - velocity_deg_per_s);
  }

  void accept(const DriveReading& next, double now) {
    const double velocity = velocity_of(next, now);
    last_reading = next;
    last_reading_s = now;
    {
      const std::lock_guard lock(mutex);
      link_error.reset();
      reading = next;
      velocity_deg_per_s = velocity;
      reading_s = now;
      reported_once = true;
      drive_state = state_of(next);
    }
    if (supervisor.observe(now, next) == MotionSupervisor::Action::kSendStop) send_stop();
    // Whatever it does that no one asked for here, e.g. what was begun before contact was lost, is ended.
    const bool automatic = next.moving.value_or(false) && !supervisor.under_way();
    if (automatic && !safety_stop_sent) send_stop();
    safety_stop_sent = automatic;
  }

  void send_stop() {
    if (!drive->linked()) return;
    // One more try at once: of all orders this is the one that must arrive.
    auto error = drive->stop();
    if (error && drive->linked()) error = drive->stop();
    const std::lock_guard lock(mutex);
    if (error) {
      ++failures;
      order_error = error;
    }
  }

  void stop_motion(MotionEnd how, std::optional<hal::Error> why) {
    if (supervisor.stop(now_s(), how, std::move(why)) == MotionSupervisor::Action::kSendStop) send_stop();
  }

  void ask_permit() {
    if (!supervisor.under_way() || supervisor.stopping()) return;
    if (auto why_not = permitted()) stop_motion(MotionEnd::kForbidden, std::move(why_not));
  }

  std::optional<hal::Error> permitted() {
    hal::MotionPermit asked;
    {
      const std::lock_guard lock(mutex);
      asked = permit;
    }
    return asked ? asked() : std::nullopt;
  }

  void watch_age() {
    if (!supervisor.under_way()) return;
    double last = 0.0;
    hal::Error why;
    {
      const std::lock_guard lock(mutex);
      last = reading_s;
      if (link_error) why = *link_error;
    }
    const double age = now_s() - last;
    if (age <= settings.stale_after_s) return;
    send_stop();
    hal::Error lost{"contact with the drive was lost on the way: where the table stands is not known",
                    "turntable", "no usable position for " + number(age, "s"),
                    number(settings.stale_after_s, "s"),
                    "look at the table; the drive may go on by itself until contact is back"};
    if (!why.what.empty()) lost.value += "; " + why.text();
    supervisor.abandon(now_s(), MotionEnd::kLost, std::move(lost));
  }

  void refuse(const hal::Error& why) {
    supervisor.abandon(now_s(), MotionEnd::kRefused, why);
    const std::lock_guard lock(mutex);
    order_error = why;
  }

  void perform(const Orders& wanted) {
    if (wanted.stop) {
      if (supervisor.under_way()) {
        stop_motion(MotionEnd::kStopped,
                    hal::Error{"the motion was stopped", "turntable", "", "", "begin another one"});
      } else {
        send_stop();
      }
    }
    if (wanted.clear && drive->linked()) {
      auto error = drive->reset_alarm();
      const std::lock_guard lock(mutex);
      order_error = error;
      stalled = false;
    }
    if (wanted.home || wanted.move) begin(wanted);
  }

  void begin(const Orders& wanted) {
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
    const auto error =
        wanted.move ? drive->start_move(wanted.move->first, wanted.move->second) : drive->start_home();
    if (error) {
      // Part of it may have been taken.
      send_stop();
      refuse(*error);
    }
    {
      const std::lock_guard lock(mutex);
      if (!error) order_error.reset();
    }
    next_poll = Clock::now();
  }

  TurntableState state_of(const DriveReading& now) const {
    if (now.alarm.value_or(false)) return TurntableState::kAlarm;
    if (supervisor.under_way()) {
      return supervisor.report().kind == hal::MotionKind::kHome ? TurntableState::kHoming
                                                                : TurntableState::kMoving;
    }
    if (stalled) return TurntableState::kStalled;
    if (now.moving.value_or(false)) return TurntableState::kMoving;
    return now.homed.value_or(false) ? TurntableState::kStanding : TurntableState::kNotHomed;
  }

  void publish() {
    {
      const std::lock_guard lock(mutex);
      const bool ended = motion.end == MotionEnd::kUnderWay && !supervisor.under_way();
      motion = supervisor.report();
      if (ended && motion.end == MotionEnd::kStalled) stalled = true;
      drive_state = state_of(reading);
    }
    changed.notify_all();
  }

  // ---- any thread ---------------------------------------------------------------------------------------

  double age_locked() const {
    return reported_once ? now_s() - reading_s : std::numeric_limits<double>::infinity();
  }

  TurntableState state_locked() const {
    if (!engaged) return TurntableState::kIdle;
    if (!reported_once) return TurntableState::kConnecting;
    if (age_locked() > settings.stale_after_s) return TurntableState::kLost;
    return drive_state;
  }

  bool busy_locked() const { return motion.end == MotionEnd::kUnderWay || motion.number < ordered; }

  /// Why no motion can begin now.
  std::optional<hal::Error> refusal_locked(bool needs_homed) const {
    const TurntableState state = state_locked();
    hal::Error error{"", "turntable", hal::word_of(state), "", ""};
    if (state == TurntableState::kIdle) return not_engaged();
    if (busy_locked()) {
      error.what = "another motion is under way";
      error.remedy = "wait until it has ended, or stop it";
    } else if (state == TurntableState::kConnecting || state == TurntableState::kLost) {
      error.what = "the table's position is not known: it does not turn without a fresh one";
      error.limit = "not older than " + number(settings.stale_after_s, "s");
      error.remedy = link_error ? link_error->text() : "wait until the drive answers";
    } else if (state == TurntableState::kAlarm) {
      error.what = "the drive reports an alarm";
      error.value =
          "code " + std::to_string(reading.alarm_code) + ", " + drive->alarm_text(reading.alarm_code);
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

  hal::Result<std::uint64_t> order(bool needs_homed,
                                   std::optional<std::pair<double, hal::MotionLimits>> move) {
    if (auto why_not = permitted()) return *why_not;
    const std::lock_guard lock(mutex);
    if (auto error = refusal_locked(needs_homed)) return *error;
    orders.home = !move;
    orders.move = std::move(move);
    ordered = motion.number + 1;
    wake.notify_all();
    return ordered;
  }
};

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
  std::unique_lock engaging(s.engage_mutex);
  {
    const std::lock_guard lock(s.mutex);
    if (s.engaged) return std::nullopt;
    s.engaged = true;
    s.leave = s.reported_once = false;
    s.orders = {};
    s.link_error.reset();
    s.order_error.reset();
  }
  s.pause_s = 0.0;
  s.failures_in_a_row = 0;
  s.last_reading.reset();
  s.thread = std::thread([&s] { s.run(); });

  std::optional<hal::Error> problem;
  {
    std::unique_lock lock(s.mutex);
    const auto timeout = std::chrono::duration<double>(s.settings.engage_timeout_s);
    if (s.changed.wait_for(lock, timeout, [&s] { return s.reported_once; })) return std::nullopt;
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
  const std::lock_guard engaging(s.engage_mutex);
  {
    const std::lock_guard lock(s.mutex);
    s.leave = true;
  }
  s.wake.notify_all();
  if (s.thread.joinable()) s.thread.join();
  const std::lock_guard lock(s.mutex);
  s.engaged = false;
  s.reported_once = false;
  s.ordered = s.motion.number;
}

hal::TurntableStatus DrivenTurntable::status() const {
  const State& s = *state_;
  const std::lock_guard lock(s.mutex);
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
  const std::lock_guard lock(s.mutex);
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
  const std::lock_guard lock(state_->mutex);
  state_->permit = std::move(permit);
}

hal::Result<std::uint64_t> DrivenTurntable::home() {
  return state_->order(false, std::nullopt);
}

hal::Result<std::uint64_t> DrivenTurntable::move_to(double angle_deg, const hal::MotionLimits& limits) {
  const State& s = *state_;
  if (!(angle_deg >= s.settings.min_deg && angle_deg <= s.settings.max_deg)) {
    return hal::Error{
        std::isfinite(angle_deg) ? "the angle is out of the table's range" : "the angle is not finite",
        "angle_deg", number(angle_deg, "deg"), range_text(s.settings), "choose an angle in the range"};
  }
  const auto checked = [](double wanted, double most, const char* where, const char* unit,
                          double& granted) -> std::optional<hal::Error> {
    granted = wanted == 0.0 ? most : wanted;
    if (granted > 0.0 && granted <= most) return std::nullopt;
    return hal::Error{"the limit of the motion is out of range", where, number(wanted, unit),
                      "above 0, at most " + number(most, unit), "choose a value in the range"};
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
    const std::lock_guard lock(state_->mutex);
    if (!state_->engaged) return;
    state_->orders.stop = true;
  }
  state_->wake.notify_all();
}

std::optional<hal::Error> DrivenTurntable::clear_alarm() {
  {
    const std::lock_guard lock(state_->mutex);
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
