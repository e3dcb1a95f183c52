#include "server/safety_latch.h"

#include <algorithm>
#include <string>

#include "server/log.h"

namespace hapticd::server {

namespace {

constexpr std::size_t kLongestReason = 256;

/// A reason for the log: one line, bounded.
std::string one_line(std::string_view reason) {
  std::string text(reason.substr(0, kLongestReason));
  std::replace_if(
      text.begin(), text.end(), [](char c) { return static_cast<unsigned char>(c) < 0x20 || c == 0x7f; },
      ' ');
  return text;
}

std::string_view name_of(rt::GuardFault fault) {
  return fault == rt::GuardFault::kNone ? "nothing was latched" : rt::rule_of(fault).cause;
}

}  // namespace

rt::GuardFault SafetyLatch::stop(std::string_view reason) {
  session_.engine().stop();
  // A tick under way may have looked already; the one after the next has seen it for certain.
  stopped_by_.store(session_.engine().last_tick() + 3);
  stopped_.store(true);
  log_warning("stopped: " + (reason.empty() ? std::string("no reason given") : one_line(reason)));
  const rt::TickRecord last = hub_.latest();
  return last.guard_state == rt::GuardState::kLatched ? last.guard_fault : rt::GuardFault::kStopped;
}

Outcome<SafetyLatch::Cleared> SafetyLatch::clear(const Caller& caller) {
  const rt::TickRecord last = hub_.latest();
  Cleared cleared;
  if (last.guard_state == rt::GuardState::kLatched) {
    cleared.fault = last.guard_fault;
  } else if (stopped_.load()) {
    cleared.fault = rt::GuardFault::kStopped;
  }
  rt::EngineCommand command;
  command.kind = rt::EngineCommand::Kind::kClear;
  command.at_tick = stopped_.load() ? stopped_by_.load() : 0;  // never before the stop it is to clear
  const auto outcome = session_.execute(command, caller, kDefaultPatience);
  if (!outcome) {
    Refusal refusal = outcome.refusal();
    if (refusal.kind == RefusalKind::kFailedPrecondition && cleared.fault != rt::GuardFault::kNone) {
      refusal.error.value = name_of(cleared.fault);
      refusal.error.remedy = std::string(rt::rule_of(cleared.fault).remedy) + ", then clear again";
    }
    return refusal;
  }
  stopped_.store(false);
  cleared.state = cleared.fault == rt::GuardFault::kNone ? last.guard_state : rt::GuardState::kResuming;
  cleared.effective_tick = outcome->tick;
  log_info("cleared: " + std::string(name_of(cleared.fault)));
  return cleared;
}

}  // namespace hapticd::server
