#include "server/session/guard_log.h"

#include <fmt/format.h>
#include <pthread.h>

#include <chrono>

#include "rt/guard/fault_table.h"
#include "server/process/log.h"
#include "server/telemetry/telemetry_hub.h"

namespace hapticd::server {

namespace {
constexpr std::chrono::milliseconds kRound{200};
}  // namespace

std::optional<std::string> latch_line(const rt::TickRecord& before, const rt::TickRecord& now) {
  using enum rt::GuardFault;
  const bool latched = now.guard_state == rt::GuardState::kLatched;
  const bool known = before.guard_state == rt::GuardState::kLatched && before.guard_fault == now.guard_fault;
  if (!latched || known || now.guard_fault == kNone || now.guard_fault == kStopped) return std::nullopt;
  const rt::FaultRule& rule = rt::rule_of(now.guard_fault);
  return fmt::format("guard latched in tick {} or shortly before, {}: {}; no force until it is cleared",
                     now.tick, rule.name, rule.cause);
}

GuardLog::~GuardLog() {
  {
    const std::lock_guard lock(mutex_);
    stop_requested_ = true;
  }
  stop_signal_.notify_one();
  if (thread_.joinable()) thread_.join();
}

void GuardLog::start() {
  thread_ = std::thread([this] { run(); });
}

void GuardLog::run() {
  pthread_setname_np(pthread_self(), "hapticd-guard");
  rt::TickRecord before;
  std::unique_lock lock(mutex_);
  while (!stop_requested_) {
    lock.unlock();
    const rt::TickRecord now = hub_.latest();
    if (const auto line = latch_line(before, now)) log_warning(*line);
    before = now;
    lock.lock();
    stop_signal_.wait_for(lock, kRound, [this] { return stop_requested_; });
  }
}

}  // namespace hapticd::server
