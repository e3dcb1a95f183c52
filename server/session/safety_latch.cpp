#include "server/session/safety_latch.h"

#include <chrono>
#include <string>
#include <thread>

#include "server/process/log.h"

namespace hapticd::server {

namespace {

constexpr std::chrono::milliseconds kLastTickTimeout{100};
constexpr std::chrono::microseconds kPollInterval{200};

/// First of the faults present that takes the force away; `otherwise` if none is any more.
rt::GuardFault present_fault(rt::FaultSet present, rt::GuardFault otherwise) {
  for (const rt::FaultRule& rule : rt::kFaultTable) {
    const bool takes = rule.action != rt::FaultAction::kWarn;
    if (takes && (present & rt::set_of(rule.fault)) != 0) return rule.fault;
  }
  return otherwise;
}

std::string_view name_of(rt::GuardFault fault) {
  return fault == rt::GuardFault::kNone ? "nothing was latched" : rt::rule_of(fault).cause;
}

}  // namespace

std::uint64_t SafetyLatch::stop() noexcept {
  session_.engine().stop();
  const std::uint64_t last_tick = session_.engine().last_tick();
  // The present tick may have checked before the stop; the second one after it has certainly seen it.
  stopped_by_.store(last_tick + 3);
  stopped_.store(true);
  return last_tick;
}

rt::GuardFault SafetyLatch::fault_after_stop() {
  const rt::TickRecord last = hub_.latest();
  return last.guard_state == rt::GuardState::kLatched ? last.guard_fault : rt::GuardFault::kStopped;
}

void SafetyLatch::end_rendering() {
  const std::uint64_t seen_by = stop() + 2;
  const auto until = std::chrono::steady_clock::now() + kLastTickTimeout;
  while (session_.running() && session_.last_tick() < seen_by && std::chrono::steady_clock::now() < until) {
    std::this_thread::sleep_for(kPollInterval);
  }
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
  const auto outcome = session_.execute(command, caller, kDefaultTimeout);
  if (!outcome) {
    Refusal refusal = outcome.refusal();
    if (refusal.kind == RefusalKind::kFailedPrecondition && cleared.fault != rt::GuardFault::kNone) {
      const rt::GuardFault persists = present_fault(hub_.latest().faults_present, cleared.fault);
      const std::string more = explain_(persists);
      refusal.error.value = more.empty() ? name_of(persists) : more;
      refusal.error.remedy = std::string(rt::rule_of(persists).remedy) + ", then clear again";
    }
    return refusal;
  }
  stopped_.store(false);
  if (on_cleared_) on_cleared_();
  cleared.state = cleared.fault == rt::GuardFault::kNone ? last.guard_state : rt::GuardState::kResuming;
  cleared.effective_tick = outcome->tick;
  log_info("cleared: " + std::string(name_of(cleared.fault)));
  return cleared;
}

}  // namespace hapticd::server
