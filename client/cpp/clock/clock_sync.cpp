#include "client/cpp/clock/clock_sync.h"

#include <algorithm>

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
    : client_(client), options_(options), estimator_(options.max_drift_ppm) {
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
    estimator_ = ClockEstimator(options_.max_drift_ppm);
    converter_ = ClockConverter();
  }
  try {
    estimator_.add(stamps);
  } catch (...) {
    converter_ = ClockConverter();
    throw;
  }
  converter_.follow(estimator_.bounds(stamps.client_received_ns), estimator_.drift().ppm);
  ++exchanges_;
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
  if (!estimator_.empty()) return;
  throw clock_error("the daemon's clock is not known", "exchange of clocks", problem_ ? problem_->what() : "",
                    "", "wait for the next exchange");
}

ClockBounds ClockSync::bounds() const {
  const std::lock_guard lock(mutex_);
  require_known();
  return estimator_.bounds(now_ns());
}

ClockDrift ClockSync::drift() const {
  const std::lock_guard lock(mutex_);
  return estimator_.drift();
}

DaemonTime ClockSync::to_daemon(std::int64_t client_ns) const {
  const std::int64_t now = now_ns();
  if (client_ns < -now || client_ns > now + kMaxAheadNs) {
    throw clock_error("a time that cannot be converted", "ClockSync::to_daemon",
                      std::to_string(client_ns) + " ns", "at most 1 s after now, by CLOCK_MONOTONIC",
                      "see which clock it is from");
  }
  const std::lock_guard lock(mutex_);
  require_known();
  const std::int64_t daemon_ns = converter_.to_daemon_ns(client_ns);
  const ClockBounds bounds = estimator_.bounds(client_ns);
  const std::int64_t offset_ns = daemon_ns - client_ns;
  const std::int64_t worst_ns = std::max(bounds.upper_ns - offset_ns, offset_ns - bounds.lower_ns);
  return {daemon_ns, 1e-6 * static_cast<double>(worst_ns)};
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
