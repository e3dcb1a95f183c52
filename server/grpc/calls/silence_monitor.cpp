#include "server/grpc/calls/silence_monitor.h"

#include <pthread.h>

#include <utility>

namespace hapticd::server {

SilenceMonitor::SilenceMonitor(std::chrono::milliseconds limit, Callback<void()> on_silence)
    : limit_(limit), on_silence_(std::move(on_silence)), thread_([this] { run(); }) {}

SilenceMonitor::~SilenceMonitor() {
  {
    const MutexLock lock(mutex_);
    ending_ = true;
  }
  changed_.notify_one();
  thread_.join();
}

void SilenceMonitor::begin() {
  const MutexLock lock(mutex_);
  until_ = Clock::now() + limit_;
  changed_.notify_one();
}

void SilenceMonitor::end() {
  const MutexLock lock(mutex_);
  until_ = Clock::time_point::max();
}

bool SilenceMonitor::was_silent() const {
  const MutexLock lock(mutex_);
  return was_silent_;
}

void SilenceMonitor::run() {
  pthread_setname_np(pthread_self(), "silence");
  MutexLock lock(mutex_);
  while (!ending_) {
    if (until_ == Clock::time_point::max()) {
      changed_.wait(mutex_);
    } else if (const auto until = until_; Clock::now() < until) {
      changed_.wait_until(mutex_, until);
    } else {
      was_silent_ = true;
      lock.unlock();
      on_silence_();
      return;
    }
  }
}

}  // namespace hapticd::server
