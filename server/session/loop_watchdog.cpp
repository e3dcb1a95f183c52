#include "server/session/loop_watchdog.h"

#include <pthread.h>

#include <algorithm>
#include <memory>
#include <optional>
#include <utility>

#include "server/session/session.h"

namespace hapticd::server {

namespace {

constexpr std::chrono::milliseconds kShortestInterval{1};

}  // namespace

LoopWatchdog::LoopWatchdog(Progress progress, Feed feed, std::chrono::microseconds timeout)
    : progress_(std::move(progress)),
      feed_(std::move(feed)),
      interval_(std::max<std::chrono::microseconds>(timeout / 4, kShortestInterval)),
      thread_([this] { run(); }) {}

LoopWatchdog::~LoopWatchdog() {
  {
    const MutexLock lock(mutex_);
    ending_ = true;
  }
  ending_signal_.notify_one();
  thread_.join();
}

void LoopWatchdog::run() {
  pthread_setname_np(pthread_self(), "hapticd-watch");
  std::optional<std::uint64_t> before;
  MutexLock lock(mutex_);
  while (!ending_) {
    lock.unlock();
    const std::uint64_t now = progress_();
    if (before != now) feed_();
    before = now;
    lock.lock();
    const auto next = std::chrono::steady_clock::now() + interval_;
    while (!ending_ && ending_signal_.wait_until(mutex_, next)) {
    }
  }
}

LoopWatchdog::Progress progress_of(const Session& session) {
  return [&session, looks = std::make_shared<std::uint64_t>(0)] {
    if (session.stopping() || session.exhausted()) ++*looks;
    return session.last_tick() + session.clock_losses() + *looks;
  };
}

}  // namespace hapticd::server
