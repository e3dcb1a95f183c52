#include "server/recording/guard_monitor.h"

#include <fmt/format.h>
#include <pthread.h>

#include <chrono>
#include <utility>

#include "server/process/log.h"
#include "server/process/system_clock.h"

namespace hapticd::server {

namespace {

constexpr std::chrono::milliseconds kRound{50};
constexpr std::uint32_t kGuardRecordsAtOnce = 2048;
constexpr std::uint32_t kQueue = 20'000;

}  // namespace

GuardMonitor::~GuardMonitor() {
  {
    const MutexLock lock(mutex_);
    stop_requested_ = true;
  }
  stop_signal_.notify_one();
  if (thread_.joinable()) thread_.join();
  if (subscription_) hub_.unsubscribe(subscription_);
}

void GuardMonitor::start() {
  SubscriptionOptions options;
  options.batch_size = kGuardRecordsAtOnce;
  options.is_own = true;
  options.longest_wait = std::chrono::milliseconds(0);
  options.queue_samples = kQueue;
  subscription_ = hub_.subscribe(std::move(options));
  thread_ = std::thread([this] { run(); });
}

void GuardMonitor::run() {
  pthread_setname_np(pthread_self(), "hapticd-guard");
  MutexLock lock(mutex_);
  while (!stop_requested_) {
    lock.unlock();
    take_records();
    lock.lock();
    if (!stop_requested_) stop_signal_.wait_for(mutex_, kRound);
  }
}

void GuardMonitor::take_records() {
  Subscription::Batch batch;
  while (subscription_->take(batch, Subscription::Clock::now())) {
    for (const Subscription::Entry& entry : batch.entries) {
      for (WatchedEvent& watched : watch_.look(entry.record())) report(std::move(watched));
    }
  }
}

void GuardMonitor::report(WatchedEvent watched) {
  recording::Event& event = watched.event;
  // A loaded scene, and who loaded it, is an event of the call.
  if (event.kind == recording::EventKind::kScene) return;
  if (event.kind == recording::EventKind::kFault && !watched.ends_by_itself) {
    log_warning(fmt::format("guard latched in tick {}, {}", event.tick, event.text));
  }
  event.unix_ns = read_clocks().utc_ns;
  event_log_.add_from_records(std::move(event));
}

}  // namespace hapticd::server
