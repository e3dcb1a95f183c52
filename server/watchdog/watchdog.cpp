#include "server/watchdog/watchdog.h"

#include <pthread.h>
#include <sys/random.h>

#include <stdexcept>
#include <utility>

#include "server/process/log.h"
#include "server/session/session.h"

namespace hapticd::server {

namespace {

std::uint64_t random_nonce() {
  std::uint64_t nonce = 0;
  while (nonce == 0) {
    if (getrandom(&nonce, sizeof nonce, 0) != static_cast<ssize_t>(sizeof nonce)) {
      throw std::runtime_error("the kernel gives no random bytes");
    }
  }
  return nonce;
}

void write_lines(const std::vector<std::string>& lines) {
  for (const std::string& line : lines) log_warning(line);
}

}  // namespace

Watchdog::Watchdog(const WatchdogConfig& config, Session& session)
    : session_(session), has_endpoints_(!config.endpoints.empty()), table_(config, random_nonce) {
  if (!has_endpoints_) return;
  LogLines lines;
  {
    const MutexLock lock(mutex_);
    pass_on(lines);
  }
  write_lines(lines);
  thread_ = std::thread([this] { run(); });
}

Watchdog::~Watchdog() {
  {
    const MutexLock lock(mutex_);
    ending_ = true;
  }
  wake_.notify_all();
  if (thread_.joinable()) thread_.join();
}

Outcome<CheckInAnswer> Watchdog::check_in(const CheckInRecord& check_in) {
  LogLines lines;
  MutexLock lock(mutex_);
  // What was missing until now is known before it is alive again: it latches.
  const auto now = Clock::now();
  table_.lapse(now);
  pass_on(lines);
  const auto answer = table_.check_in(check_in, now);
  pass_on(lines);
  lock.unlock();
  if (answer && answer->counted) wake_.notify_all();
  write_lines(lines);
  return answer;
}

std::vector<EndpointView> Watchdog::views() const {
  const MutexLock lock(mutex_);
  return table_.views(Clock::now());
}

// Sets a fault. One that is over before the next tick latches, too: it is raised as well.
void Watchdog::set_fault(rt::GuardFault fault, bool present) {
  session_.engine().set_standing(fault, present);
  if (present) session_.engine().raise(fault);
}

void Watchdog::permit_until(Clock::time_point until) {
  // A rig that owns its time runs faster or slower than what the watchdog counts in.
  if (session_.rig_owns_clock()) return;
  const std::chrono::nanoseconds left = until - Clock::now();
  session_.engine().set_permit_until(session_.now_ns() + left.count());
}

// Passes changes on. The loop takes them without a lock: under this one, their order is that of the changes.
void Watchdog::pass_on(LogLines& lines) {
  if (!has_endpoints_) return;
  const bool missing = !table_.all_alive();
  const bool released = table_.any_released();
  // The permit first: it is what the end of "missing" is good for.
  if (const auto until = table_.next_lapse(); until && !missing) permit_until(*until);
  if (missing != std::exchange(missing_, missing)) {
    set_fault(rt::GuardFault::kEndpointMissing, missing);
    lines.push_back(missing ? "no force: " + missing_words(table_.views(Clock::now()))
                            : "all endpoints of the watchdog check in");
  }
  if (released != std::exchange(released_, released)) {
    set_fault(rt::GuardFault::kPedalReleased, released);
    lines.emplace_back(released ? "no force: a pedal was released" : "the pedals are pressed");
  }
}

void Watchdog::run() {
  pthread_setname_np(pthread_self(), "watchdog");
  MutexLock lock(mutex_);
  while (!ending_) {
    if (const auto next = table_.next_lapse()) {
      wake_.wait_until(mutex_, *next);
    } else {
      wake_.wait(mutex_);
    }
    LogLines lines;
    table_.lapse(Clock::now());
    pass_on(lines);
    if (lines.empty()) continue;
    lock.unlock();
    write_lines(lines);
    lock.lock();
  }
}

}  // namespace hapticd::server
