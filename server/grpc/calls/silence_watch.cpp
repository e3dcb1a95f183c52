#include "server/grpc/calls/silence_watch.h"

#include <pthread.h>

#include <utility>

namespace hapticd::server {

SilenceWatch::SilenceWatch(std::chrono::milliseconds limit, Callback<void()> on_silence)
    : limit_(limit), on_silence_(std::move(on_silence)), thread_([this] { run(); }) {}

SilenceWatch::~SilenceWatch() {
  {
    const MutexLock lock(mutex_);
    ending_ = true;
  }
  changed_.notify_one();
  thread_.join();
}

void SilenceWatch::begin() {
  const MutexLock lock(mutex_);
  until_ = Clock::now() + limit_;
  changed_.notify_one();
}

void SilenceWatch::end() {
  const MutexLock lock(mutex_);
  until_ = Clock::time_point::max();
}

bool SilenceWatch::was_silent() const {
  const MutexLock lock(mutex_);
  return was_silent_;
}

void SilenceWatch::run() {
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
