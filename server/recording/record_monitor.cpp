#include "server/recording/record_monitor.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "rt/guard/fault_table.h"

namespace hapticd::server {

namespace {

using recording::Event;
using recording::EventKind;

/// Overruns come in swarms, and an ordinary kernel has one each few seconds: one event a minute says how many.
constexpr std::int64_t kOverrunPauseNs = 60'000'000'000;

bool is_without_force(rt::GuardState state) {
  return state == rt::GuardState::kLatched || state == rt::GuardState::kSuspended;
}

const char* words_of(rt::OverrunCause cause) {
  switch (cause) {
    case rt::OverrunCause::kWakeUp:
      return "a late wake-up";
    case rt::OverrunCause::kCompute:
      return "the computation";
    case rt::OverrunCause::kDevice:
      return "the device";
    case rt::OverrunCause::kNone:
      break;
  }
  return "nothing";
}

Event event_at(const rt::TickRecord& record, EventKind kind, std::string text) {
  Event event;
  event.time_ns = record.time_ns;
  event.tick = record.tick;
  event.kind = kind;
  event.text = std::move(text);
  return event;
}

}  // namespace

std::string fault_words(rt::GuardFault fault) {
  if (fault == rt::GuardFault::kNone) return "none";
  const rt::FaultRule& rule = rt::rule_of(fault);
  return fmt::format("{}: {}", rule.name, rule.cause);
}

std::vector<WatchedEvent> RecordMonitor::look(const rt::TickRecord& record) {
  std::vector<WatchedEvent> events;
  if (has_last_ && record.scene_generation != last_scene_) {
    events.push_back({event_at(record, EventKind::kScene,
                               fmt::format("scene number {} is in force", record.scene_generation))});
  }
  if (record.jump_count > last_jump_count_) {
    const hal::Vector3& jump_n = record.last_jump_n;
    events.push_back({event_at(record, EventKind::kSensor,
                               fmt::format("the sensor's reading jumped by {:.2f} N",
                                           std::sqrt(dot(jump_n, jump_n))))});
  }
  last_jump_count_ = std::max(last_jump_count_, record.jump_count);
  look_at_guard(record, events);
  look_at_timing(record, events);
  has_last_ = true;
  last_scene_ = record.scene_generation;
  last_state_ = record.guard_state;
  last_fault_ = record.guard_fault;
  last_present_ = record.faults_present;
  return events;
}

void RecordMonitor::look_at_guard(const rt::TickRecord& record, std::vector<WatchedEvent>& events) const {
  const bool without = is_without_force(record.guard_state);
  const bool was_without = has_last_ && is_without_force(last_state_);
  const bool is_known = was_without && record.guard_fault == last_fault_ && record.guard_state == last_state_;
  if (without && !is_known) {
    const bool stopped = record.guard_fault == rt::GuardFault::kStopped;
    std::string text =
        stopped ? std::string("stopped: zero force until someone clears")
                : fmt::format("{}; {}", fault_words(record.guard_fault),
                              record.guard_state == rt::GuardState::kLatched ? "no force until it is cleared"
                                                                             : "no force until it is over");
    if (!has_last_) text += "; so it was at the beginning";
    events.push_back({event_at(record, stopped ? EventKind::kStop : EventKind::kFault, std::move(text)),
                      record.guard_fault, record.guard_state == rt::GuardState::kSuspended});
  }
  // One that is over within its tick takes the force for a moment, and shows in no state of the guard.
  const rt::FaultSet reported = without ? rt::set_of(record.guard_fault) : 0;
  for (const rt::FaultRule& rule : rt::kFaultTable) {
    const bool is_new = (record.faults_present & ~last_present_ & ~reported & rt::set_of(rule.fault)) != 0;
    const bool is_brief =
        rule.action != rt::FaultAction::kWarn && rule.clearing == rt::FaultClearing::kItself;
    if (!has_last_ || !is_new || !is_brief || was_without) continue;
    events.push_back({event_at(record, EventKind::kFault, fault_words(rule.fault) + "; it was over at once"),
                      rule.fault, true});
  }
  if (!without && was_without) {
    events.push_back(
        {event_at(record, EventKind::kCleared, "the force comes back after " + fault_words(last_fault_))});
  }
}

void RecordMonitor::look_at_timing(const rt::TickRecord& record, std::vector<WatchedEvent>& events) {
  if (record.timing.overrun == rt::OverrunCause::kNone) return;
  ++overruns_;
  if (record.time_ns < next_overrun_ns_) return;
  next_overrun_ns_ = record.time_ns + kOverrunPauseNs;
  events.push_back({event_at(
      record, EventKind::kOverrun,
      fmt::format("a period was overrun by {} ({} since the last one reported; periods missed here: {})",
                  words_of(record.timing.overrun), overruns_, record.timing.periods_missed))});
  overruns_ = 0;
}

}  // namespace hapticd::server
