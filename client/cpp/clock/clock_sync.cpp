#include "client/cpp/clock/clock_sync.h"

#include <string>

#include "client/cpp/clock/clock_error.h"

namespace hapticd::client {
namespace {

constexpr std::chrono::seconds kFirst{2};
/// One right after the other: the later ones meet threads that are awake, and take less time.
constexpr int kAtOnce = 5;
constexpr std::int64_t kMaxAheadNs = 1'000'000'000;

}  // namespace

std::int64_t ClockSync::now_ns() {
  return std::chrono::duration_cast<std::chrono::nanoseconds>(
             std::chrono::steady_clock::now().time_since_epoch())
      .count();
}

ClockSync::ClockSync(Client& client, ClockSyncOptions options)
    : client_(client), options_(options), daemon_(options.max_drift_ppm) {
  exchange();
  thread_ = std::thread([this] { run(); });
}

ClockSync::~ClockSync() {
  {
    const std::lock_guard lock(mutex_);
    ending_ = true;
  }
  changed_.notify_all();
  if (thread_.joinable()) thread_.join();
}

void ClockSync::exchange() {
  ClockExchange stamps;
  v1::ExchangeRequest request;
  stamps.client_sent_ns = now_ns();
  request.set_client_sent_ns(stamps.client_sent_ns);
  const v1::ExchangeResponse answer = client_.exchange_clocks(request);
  stamps.client_received_ns = now_ns();
  stamps.daemon_received_ns = answer.daemon_received_ns();
  stamps.daemon_sent_ns = answer.daemon_sent_ns();
  const std::lock_guard lock(mutex_);
  if (answer.clock() != clock_) {  // another start of the daemon's machine: nothing of before holds
    clock_ = answer.clock();
    daemon_.forget();
  }
  daemon_.add(stamps);
  ++exchanges_;
  note_rig(answer);
}

void ClockSync::note_rig(const v1::ExchangeResponse& answer) {
  if (answer.rig().clock() != rig_clock_) {
    rig_clock_ = answer.rig().clock();
    rig_.forget();
    rig_read_ns_ = 0;
  }
  // Several exchanges meet the same reading.
  if (!answer.has_rig() || answer.rig().begun_ns() <= rig_read_ns_) return;
  rig_read_ns_ = answer.rig().done_ns();
  // To read the rig is an exchange, too: sent, stamped by the rig, received.
  rig_.add({answer.rig().begun_ns(), answer.rig().rig_time_ns(), answer.rig().rig_time_ns(),
            answer.rig().done_ns()});
}

void ClockSync::run() {
  const auto began = std::chrono::steady_clock::now();
  std::unique_lock lock(mutex_);
  while (!ending_) {
    const bool first = std::chrono::steady_clock::now() - began < kFirst;
    changed_.wait_for(lock, first ? options_.first_pause : options_.pause, [this] { return ending_; });
    if (ending_) return;
    lock.unlock();
    std::optional<Error> problem;
    try {
      for (int i = 0; i < kAtOnce; ++i) exchange();
    } catch (const Error& error) {
      problem = error;
    }
    lock.lock();
    problem_ = std::move(problem);
  }
}

void ClockSync::require_known() const {
  if (!daemon_.empty()) return;
  throw clock_error("the daemon's clock is not known", "exchange of clocks", problem_ ? problem_->what() : "",
                    "", "wait for the next exchange");
}

ClockBounds ClockSync::bounds() const {
  const std::lock_guard lock(mutex_);
  require_known();
  return daemon_.estimator().bounds(now_ns());
}

ClockDrift ClockSync::drift() const {
  const std::lock_guard lock(mutex_);
  return daemon_.estimator().drift();
}

ClockLink::Converted ClockSync::converted(std::int64_t client_ns, const char* where) const {
  const std::int64_t now = now_ns();
  if (client_ns < -now || client_ns > now + kMaxAheadNs) {
    throw clock_error("a time that cannot be converted", where, std::to_string(client_ns) + " ns",
                      "at most 1 s after now, by CLOCK_MONOTONIC", "see which clock it is from");
  }
  require_known();
  return daemon_.convert(client_ns);
}

DaemonTime ClockSync::to_daemon(std::int64_t client_ns) const {
  const std::lock_guard lock(mutex_);
  const ClockLink::Converted time = converted(client_ns, "ClockSync::to_daemon");
  return {time.ns, time.bound_ms};
}

RigTime ClockSync::to_rig(std::int64_t client_ns) const {
  const std::lock_guard lock(mutex_);
  const ClockLink::Converted daemon = converted(client_ns, "ClockSync::to_rig");
  if (rig_.empty()) {
    throw clock_error("the rig's clock is not known", "ClockSync::to_rig", problem_ ? problem_->what() : "",
                      "a rig that runs in real time, and whose loop runs",
                      "see the loop in hapticctl status; a recording has a time of its own");
  }
  const ClockLink::Converted rig = rig_.convert(daemon.ns);
  return {rig.ns, daemon.bound_ms + rig.bound_ms};
}

std::optional<Error> ClockSync::problem() const {
  const std::lock_guard lock(mutex_);
  return problem_;
}

std::uint64_t ClockSync::exchanges() const {
  const std::lock_guard lock(mutex_);
  return exchanges_;
}

}  // namespace hapticd::client
