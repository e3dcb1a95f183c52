#include "client/cpp/clock/clock_sync.h"

#include <pthread.h>

#include <string>
#include <thread>
#include <utility>

#include "client/cpp/clock/clock_error.h"
#include "hal/lock/mutex.h"

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

struct ClockSync::State {
  /// The rig's clock runs at the rate of the daemon's; this is what the estimator needs at least.
  static constexpr double kRigDriftPpm = 0.001;

  State(Client& its_client, ClockSyncOptions its_options)
      : client(its_client), options(its_options), daemon(its_options.max_drift_ppm) {}

  /// One exchange. Throws Error.
  void exchange() EXCLUDES(mutex);
  void run() EXCLUDES(mutex);
  /// Takes what an exchange says of the rig's clock.
  void note_rig(const v1::ExchangeResponse& answer) REQUIRES(mutex);
  void require_known() const REQUIRES(mutex);
  ClockLink::Converted converted(std::int64_t client_ns, const char* where) REQUIRES(mutex);

  Client& client;
  const ClockSyncOptions options;
  Mutex mutex;
  Condition changed;
  ClockLink daemon GUARDED_BY(mutex);             ///< from this machine's clock to the daemon's
  ClockLink rig GUARDED_BY(mutex){kRigDriftPpm};  ///< from there to the rig's
  std::string clock GUARDED_BY(mutex);            ///< name of the daemon's clock
  std::string rig_clock GUARDED_BY(mutex);
  std::int64_t rig_read_ns GUARDED_BY(mutex) = 0;  ///< by the daemon's clock: the last reading that was noted
  std::uint64_t exchanges GUARDED_BY(mutex) = 0;
  std::optional<Error> problem GUARDED_BY(mutex);
  std::optional<Error> rig_problem GUARDED_BY(mutex);  ///< in the last round
  std::optional<Error> rig_failed GUARDED_BY(mutex);   ///< in the round under way
  bool ending GUARDED_BY(mutex) = false;
  std::thread thread;  // last: uses all of the above
};

ClockSync::ClockSync(Client& client, ClockSyncOptions options)
    : state_(std::make_unique<State>(client, options)) {
  state_->exchange();
  state_->thread = std::thread([state = state_.get()] { state->run(); });
}

ClockSync::~ClockSync() {
  {
    const MutexLock lock(state_->mutex);
    state_->ending = true;
  }
  state_->changed.notify_all();
  if (state_->thread.joinable()) state_->thread.join();
}

void ClockSync::State::exchange() {
  ClockExchange stamps;
  v1::ExchangeRequest request;
  stamps.client_sent_ns = now_ns();
  request.set_client_sent_ns(stamps.client_sent_ns);
  const v1::ExchangeResponse answer = client.exchange_clocks(request);
  stamps.client_received_ns = now_ns();
  stamps.daemon_received_ns = answer.daemon_received_ns();
  stamps.daemon_sent_ns = answer.daemon_sent_ns();
  const MutexLock lock(mutex);
  if (answer.clock() != clock) {  // another start of the daemon's machine: nothing of before holds
    clock = answer.clock();
    daemon.forget();
  }
  daemon.add(stamps);
  ++exchanges;
  note_rig(answer);
}

void ClockSync::State::note_rig(const v1::ExchangeResponse& answer) {
  if (answer.rig().clock() != rig_clock) {
    rig_clock = answer.rig().clock();
    rig.forget();
    rig_read_ns = 0;
  }
  // Several exchanges meet the same reading.
  if (!answer.has_rig() || answer.rig().begun_ns() <= rig_read_ns) return;
  rig_read_ns = answer.rig().done_ns();
  // To read the rig is an exchange, too: sent, stamped by the rig, received.
  try {
    rig.add({answer.rig().begun_ns(), answer.rig().rig_time_ns(), answer.rig().rig_time_ns(),
             answer.rig().done_ns()});
  } catch (const Error& error) {
    rig_failed = error;
  }
}

void ClockSync::State::run() {
  pthread_setname_np(pthread_self(), "clock-sync");
  const auto began = std::chrono::steady_clock::now();
  MutexLock lock(mutex);
  while (!ending) {
    const bool first = std::chrono::steady_clock::now() - began < kFirst;
    const auto due = std::chrono::steady_clock::now() + (first ? options.first_pause : options.pause);
    while (!ending && changed.wait_until(mutex, due)) {
    }
    if (ending) return;
    lock.unlock();
    std::optional<Error> failed;
    try {
      for (int i = 0; i < kAtOnce; ++i) exchange();
    } catch (const Error& error) {
      failed = error;
    }
    lock.lock();
    problem = std::move(failed);
    rig_problem = std::exchange(rig_failed, std::nullopt);
  }
}

void ClockSync::State::require_known() const {
  if (!daemon.empty()) return;
  throw clock_error("the daemon's clock is not known", "exchange of clocks", problem ? problem->what() : "",
                    "", "wait for the next exchange");
}

ClockLink::Converted ClockSync::State::converted(std::int64_t client_ns, const char* where) {
  const std::int64_t now = now_ns();
  if (client_ns < -now || client_ns > now + kMaxAheadNs) {
    throw clock_error("a time that cannot be converted", where, std::to_string(client_ns) + " ns",
                      "at most 1 s after now, by CLOCK_MONOTONIC", "see which clock it is from");
  }
  require_known();
  return daemon.convert(client_ns);
}

ClockBounds ClockSync::bounds() const {
  const MutexLock lock(state_->mutex);
  state_->require_known();
  return state_->daemon.estimator().bounds(now_ns());
}

ClockDrift ClockSync::drift() const {
  const MutexLock lock(state_->mutex);
  return state_->daemon.estimator().drift();
}

DaemonTime ClockSync::to_daemon(std::int64_t client_ns) const {
  const MutexLock lock(state_->mutex);
  const ClockLink::Converted time = state_->converted(client_ns, "ClockSync::to_daemon");
  return {time.ns, time.bound_ms};
}

RigTime ClockSync::to_rig(std::int64_t client_ns) const {
  const MutexLock lock(state_->mutex);
  const ClockLink::Converted daemon = state_->converted(client_ns, "ClockSync::to_rig");
  if (state_->rig.empty()) {
    const std::optional<Error>& why = state_->problem ? state_->problem : state_->rig_problem;
    throw clock_error("the rig's clock is not known", "ClockSync::to_rig", why ? why->what() : "",
                      "a rig that runs in real time, and whose loop runs",
                      "see the loop in hapticctl status; a recording has a time of its own");
  }
  const ClockLink::Converted rig = state_->rig.convert(daemon.ns);
  return {rig.ns, daemon.bound_ms + rig.bound_ms};
}

std::optional<Error> ClockSync::problem() const {
  const MutexLock lock(state_->mutex);
  return state_->problem;
}

std::optional<Error> ClockSync::rig_problem() const {
  const MutexLock lock(state_->mutex);
  return state_->rig_problem;
}

std::uint64_t ClockSync::exchanges() const {
  const MutexLock lock(state_->mutex);
  return state_->exchanges;
}

}  // namespace hapticd::client
