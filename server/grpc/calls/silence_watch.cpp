#include "server/grpc/calls/silence_watch.h"

#include <utility>

namespace hapticd::server {

SilenceWatch::SilenceWatch(std::chrono::milliseconds limit, std::function<void()> on_silence)
    : limit_(limit), on_silence_(std::move(on_silence)), thread_([this] { run(); }) {}

SilenceWatch::~SilenceWatch() {
  {
    const std::lock_guard lock(mutex_);
    ending_ = true;
  }
  changed_.notify_one();
  thread_.join();
}

void SilenceWatch::begin() {
  const std::lock_guard lock(mutex_);
  until_ = Clock::now() + limit_;
  changed_.notify_one();
}

void SilenceWatch::end() {
  const std::lock_guard lock(mutex_);
  until_ = Clock::time_point::max();
}

bool SilenceWatch::was_silent() const {
  const std::lock_guard lock(mutex_);
  return was_silent_;
}

void SilenceWatch::run() {
  std::unique_lock lock(mutex_);
  while (!ending_) {
    if (until_ == Clock::time_point::max()) {
      changed_.wait(lock);
    } else if (const auto until = until_; Clock::now() < until) {
      changed_.wait_until(lock, until);
    } else {
      was_silent_ = true;
      on_silence_();
      return;
    }
  }
}

}  // namespace hapticd::server
