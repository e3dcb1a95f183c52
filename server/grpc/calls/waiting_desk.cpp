#include "server/grpc/calls/waiting_desk.h"

#include <pthread.h>

#include <utility>

namespace hapticd::server {

WaitingDesk::WaitingDesk(const char* name) : name_(name), thread_([this] { run(); }) {}

WaitingDesk::~WaitingDesk() {
  {
    const std::lock_guard lock(mutex_);
    ending_ = true;
  }
  arrived_.notify_one();
  thread_.join();
}

bool WaitingDesk::serve(std::function<void()> call) {
  {
    const std::lock_guard lock(mutex_);
    if (waiting_.size() >= kMaxWaiting) return false;
    waiting_.push_back(std::move(call));
  }
  arrived_.notify_one();
  return true;
}

void WaitingDesk::run() {
  pthread_setname_np(pthread_self(), name_);
  std::unique_lock lock(mutex_);
  for (;;) {
    arrived_.wait(lock, [this] { return ending_ || !waiting_.empty(); });
    if (waiting_.empty()) return;
    const std::function<void()> call = std::move(waiting_.front());
    waiting_.pop_front();
    lock.unlock();
    call();
    lock.lock();
  }
}

}  // namespace hapticd::server
