#include "server/turntable/turntable_host.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <thread>
#include <utility>
#include <vector>

#include "hal/sim/simulated_rig.h"
#include "server/process/log.h"
#include "server/scene/scene_host.h"
#include "server/session/session.h"
#include "server/telemetry/telemetry_hub.h"
#include "server/text/range.h"
#include "server/text/suggestion.h"

namespace hapticd::server {

namespace {

using hal::MotionEnd;
using hal::TurntableState;
using std::chrono::milliseconds;

constexpr milliseconds kLook{2};
constexpr milliseconds kProgressPeriod{100};
constexpr milliseconds kGlitch{100};
constexpr std::chrono::seconds kAlarmTimeout{2};
constexpr const char* kWho = "the turntable's motion";
constexpr rt::GuardFault kLastingFaults[] = {
    rt::GuardFault::kTurntableLost, rt::GuardFault::kTurntableStalled, rt::GuardFault::kTurntableTimedOut,
    rt::GuardFault::kTurntableAlarm};

Refusal none_there() {
  return {RefusalKind::kFailedPrecondition,
          {"this rig has no turntable", "turntable", "", "a rig with one",
           "set kind in [rig.turntable] of the configuration"},
          Reason::kNoHardware};
}

/// What a motion that ended so means for rendering.
rt::GuardFault fault_of(MotionEnd end) {
  switch (end) {
    case MotionEnd::kTimedOut:
    case MotionEnd::kMissed:
      return rt::GuardFault::kTurntableTimedOut;
    case MotionEnd::kStalled:
      return rt::GuardFault::kTurntableStalled;
    case MotionEnd::kAlarm:
    case MotionEnd::kRefused:
      return rt::GuardFault::kTurntableAlarm;
    case MotionEnd::kLost:
      return rt::GuardFault::kTurntableLost;
    case MotionEnd::kForbidden:
      return rt::GuardFault::kTurntableMoving;
    default:
      return rt::GuardFault::kNone;
  }
}

std::vector<std::string> station_names(const hal::TurntableInfo& info) {
  std::vector<std::string> names;
  for (const hal::TurntableStation& station : info.stations) names.push_back(station.name);
  return names;
}

}  // namespace

TurntableHost::TurntableHost(std::unique_ptr<hal::Turntable> table, const InterlockConfig& interlock,
                             Session& session, SceneHost& scenes, TelemetryHub& hub)
    : session_(session),
      scenes_(scenes),
      hub_(hub),
      config_(interlock),
      interlock_(interlock),
      table_(std::move(table)) {
  if (table_) table_->set_permit([this] { return this->interlock(); });
}

TurntableHost::~TurntableHost() {
  shutdown();
}

void TurntableHost::shutdown() {
  shutting_down_.store(true);
  if (table_) table_->disengage();
}

std::optional<hal::Error> TurntableHost::interlock() {
  if (auto refusal = session_.unavailable()) return refusal->error;
  return interlock_.why_not(hub_.latest(), session_.engine().can_exchange_scene(), Interlock::Clock::now());
}

std::optional<Refusal> TurntableHost::unavailable() const {
  if (!table_) return none_there();
  if (shutting_down_.load()) {
    return Refusal{RefusalKind::kUnavailable,
                   {"the service is shutting down", "turntable", "", "", "connect again later"}};
  }
  return session_.unavailable();
}

std::optional<Refusal> TurntableHost::ready() {
  if (auto refusal = unavailable()) return refusal;
  if (auto error = table_->engage()) return Refusal{RefusalKind::kUnavailable, *error};
  // It may have been shut down while it was engaged.
  if (auto refusal = unavailable()) {
    table_->disengage();
    return refusal;
  }
  return std::nullopt;
}

Outcome<hal::TurntableStatus> TurntableHost::engage() {
  if (auto refusal = ready()) return *refusal;
  return table_->status();
}

Outcome<hal::TurntableStatus> TurntableHost::disengage() {
  if (!table_) return none_there();
  table_->disengage();
  forget_faults();
  return table_->status();
}

Outcome<hal::TurntableStatus> TurntableHost::stop() {
  if (!table_) return none_there();
  table_->stop();
  return table_->status();
}

Outcome<hal::TurntableStatus> TurntableHost::clear_alarm(const Caller& caller) {
  if (auto refusal = ready()) return *refusal;
  if (auto error = table_->clear_alarm()) return Refusal{RefusalKind::kFailedPrecondition, *error};
  const auto until = caller.until(kAlarmTimeout);
  hal::TurntableStatus now = table_->status();
  const auto ill = [&now] {
    return now.state == TurntableState::kAlarm || now.state == TurntableState::kStalled ||
           now.state == TurntableState::kLost;
  };
  while (ill() && Caller::Clock::now() < until && !caller.cancelled()) {
    std::this_thread::sleep_for(kLook);
    now = table_->status();
  }
  if (!ill()) {
    forget_faults();
    return now;
  }
  const auto findings = table_->report().findings;
  return Refusal{
      RefusalKind::kFailedPrecondition,
      {fmt::format("the turntable stays {}", hal::word_of(now.state)), "turntable",
       findings.empty() ? std::string() : findings.front(), "", "fix the cause, then clear it again"}};
}

Outcome<hal::TurntableStatus> TurntableHost::home(const Caller& caller, const Progress& progress) {
  if (auto refusal = ready()) return *refusal;
  return perform([this] { return table_->home(); }, caller, progress);
}

Outcome<double> TurntableHost::angle_of(const TurntableDestination& destination) const {
  const hal::TurntableInfo& info = table_->info();
  if (destination.angle_deg) {
    const Range range{info.min_deg, info.max_deg, "deg"};
    if (auto error = check(*destination.angle_deg, range, "the angle", "MoveToRequest.angle_deg")) {
      const bool is_finite = error->code != hal::ErrorCode::kNotFinite;
      return Refusal{is_finite ? RefusalKind::kOutOfRange : RefusalKind::kInvalidArgument, *error};
    }
    return *destination.angle_deg;
  }
  for (const hal::TurntableStation& station : info.stations) {
    if (station.name == destination.station) return station.angle_deg;
  }
  const auto names = station_names(info);
  return Refusal{RefusalKind::kNotFound,
                 {"no such station", "MoveToRequest.station", destination.station, comma_separated(names),
                  did_you_mean(destination.station, names, "use one of those")}};
}

Outcome<hal::TurntableStatus> TurntableHost::move_to(const TurntableDestination& destination,
                                                     const hal::MotionLimits& limits, const Caller& caller,
                                                     const Progress& progress) {
  if (auto refusal = unavailable()) return *refusal;
  const auto angle = angle_of(destination);
  if (!angle) return angle.refusal();
  const hal::MotionLimits& most = table_->info().limits;
  const auto wrong = [](double wanted, double greatest, const char* field,
                        const char* unit) -> std::optional<Refusal> {
    if (wanted == 0.0) return std::nullopt;
    const Range range{0.0, greatest, unit};
    auto error = check(wanted, range, "the limit of the motion", std::string("MoveToRequest.") + field);
    if (!error) return std::nullopt;
    return Refusal{RefusalKind::kOutOfRange, *error};
  };
  if (auto refusal = wrong(limits.speed_deg_per_s, most.speed_deg_per_s, "speed_deg_per_s", "deg/s")) {
    return *refusal;
  }
  if (auto refusal = wrong(limits.acceleration_deg_per_s2, most.acceleration_deg_per_s2,
                           "acceleration_deg_per_s2", "deg/s²")) {
    return *refusal;
  }
  if (auto refusal = ready()) return *refusal;
  return perform([&] { return table_->move_to(*angle, limits); }, caller, progress);
}

std::optional<Refusal> TurntableHost::needed_where_it_is() const {
  const auto scene = scenes_.current();
  if (!scene || scene->spec.turntable_station.empty()) return std::nullopt;
  return Refusal{RefusalKind::kFailedPrecondition,
                 {"the loaded scene needs the table where it is", "scene '" + scene->spec.name + "'",
                  scene->spec.turntable_station, "", "unload it first: hapticctl scene unload"}};
}

Outcome<hal::TurntableStatus> TurntableHost::perform(const Begin& begin, const Caller& caller,
                                                     const Progress& progress) {
  auto reservation = scenes_.reserve(kWho);
  if (!reservation) return reservation.refusal();
  if (auto refusal = needed_where_it_is()) return *refusal;
  // While the table turns the force sensor is watched, even if no scene uses it.
  const auto sensor = session_.claim_sensor();
  if (!sensor && !config_.turn_without_sensor) return Refusal{RefusalKind::kUnavailable, sensor.error()};
  // A tick without a sample, or the very first one, is not refused.
  const auto timeout = Caller::Clock::now() + kGlitch;
  while (this->interlock() && Caller::Clock::now() < timeout) std::this_thread::sleep_for(kLook);
  const auto number = begin();
  if (!number) return Refusal{RefusalKind::kFailedPrecondition, number.error()};
  forget_faults();
  report_motion(fmt::format("motion {} begins", *number));

  std::optional<Refusal> left;  // why the caller no longer waits
  auto next_progress = Caller::Clock::now();
  for (;;) {
    const hal::TurntableStatus now = table_->status();
    if (now.state == TurntableState::kIdle && now.motion.number < *number) {
      return Refusal{
          RefusalKind::kAborted,
          {"the turntable was disengaged before it turned", "turntable", "", "", "engage it again"}};
    }
    const bool over = (now.motion.number >= *number && now.motion.end != MotionEnd::kUnderWay) ||
                      now.state == TurntableState::kIdle;
    if (over) {
      if (now.motion.end == MotionEnd::kArrived) put_object(now);
      if (!left) (void)progress(now);
      return conclude(now, left);
    }
    if (!left) {
      const auto time = Caller::Clock::now();
      if (time >= next_progress) {
        next_progress = time + kProgressPeriod;
        if (!progress(now)) {
          left = Refusal{RefusalKind::kCancelled,
                         {"the caller went away; the table was stopped", "turntable", "", "", ""}};
        }
      }
      if (auto lost = caller.lost()) {
        left = std::move(*lost);
        left->error.what += "; the table was stopped";
      } else if (caller.cancelled()) {
        left = Refusal{RefusalKind::kCancelled,
                       {"the caller went away; the table was stopped", "turntable", "", "", ""}};
      } else if (time >= caller.deadline) {
        left = Refusal{
            RefusalKind::kDeadlineExceeded,
            {"the caller's time is over; the table was stopped", "turntable", "", "", "allow more time"}};
      }
      if (left) table_->stop();
    }
    std::this_thread::sleep_for(kLook);
  }
}

void TurntableHost::report_motion(const std::string& words) const {
  log_info("turntable: " + words);
  on_motion_(words);
}

// Reports a fault. The interlock has stopped the table: what it saw is over. All else lasts until someone
// sees to the table.
void TurntableHost::report_fault(rt::GuardFault fault) {
  if (fault == rt::GuardFault::kTurntableMoving) return session_.engine().raise(fault);
  if (fault == rt::GuardFault::kNone) return;
  session_.engine().set_standing(fault, true);
}

void TurntableHost::forget_faults() {
  for (const rt::GuardFault fault : kLastingFaults) session_.engine().set_standing(fault, false);
}

Outcome<hal::TurntableStatus> TurntableHost::conclude(const hal::TurntableStatus& end,
                                                      const std::optional<Refusal>& left) {
  const hal::MotionReport& motion = end.motion;
  report_motion(fmt::format("motion {} is over: {}{}", motion.number, hal::word_of(motion.end),
                            motion.problem ? "; " + motion.problem->text() : std::string()));
  const hal::Error problem = motion.problem.value_or(
      hal::Error{fmt::format("the motion ended: {}", hal::word_of(motion.end)), "turntable", "", "", ""});
  if (!shutting_down_.load()) report_fault(fault_of(motion.end));
  if (motion.end == MotionEnd::kArrived) return end;
  if (left && motion.end == MotionEnd::kStopped) return *left;
  return Refusal{RefusalKind::kAborted, problem};
}

void TurntableHost::put_object(const hal::TurntableStatus& end) const {
  sim::SimulatedRig* simulation = session_.simulation();
  const auto& stations = table_->info().stations;
  const bool knows_objects = std::any_of(
      stations.begin(), stations.end(), [](const hal::TurntableStation& one) { return !one.object.empty(); });
  if (simulation == nullptr || !knows_objects) return;
  std::string object = "none";  // between two stations
  for (const hal::TurntableStation& station : stations) {
    if (end.position_deg && std::abs(*end.position_deg - station.angle_deg) <= table_->info().tolerance_deg) {
      object = station.object;
    }
  }
  if (object.empty() || object == simulation->object()) return;
  if (const auto error = simulation->set_object(object)) {
    log_warning("turntable: " + error->text());
  } else {
    log_info("turntable: object '" + object + "' is under the tool");
  }
}

std::optional<Refusal> TurntableHost::require_station(const std::string& name) {
  if (!table_) {
    Refusal refusal = none_there();
    refusal.error.what = "a station is needed, and this rig has no turntable";
    return refusal;
  }
  const auto names = station_names(table_->info());
  if (std::find(names.begin(), names.end(), name) == names.end()) {
    return Refusal{RefusalKind::kFailedPrecondition,
                   {"a station is needed that the turntable does not have", "turntable", name,
                    comma_separated(names), did_you_mean(name, names, "add it to [rig.turntable.stations]")}};
  }
  if (auto refusal = ready()) return refusal;
  const hal::TurntableStatus now = table_->status();
  if (now.state == TurntableState::kStanding && now.homed && now.station == name) return std::nullopt;
  std::string where(hal::word_of(now.state));
  if (now.position_deg) where += fmt::format(", {:.2f} deg", *now.position_deg);
  const bool homed = now.state != TurntableState::kNotHomed;
  return Refusal{RefusalKind::kFailedPrecondition,
                 {"the turntable does not stand at the station that is needed", "turntable", where, name,
                  homed ? "bring it there: hapticctl turntable goto " + name
                        : "home it (hapticctl turntable home), then hapticctl turntable goto " + name}};
}

}  // namespace hapticd::server
