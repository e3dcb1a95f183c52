#include "server/grpc/calls/wait_queue.h"

#include <pthread.h>

#include <utility>

namespace hapticd::server {

WaitQueue::WaitQueue(const char* name) : name_(name), thread_([this] { run(); }) {}

WaitQueue::~WaitQueue() {
  {
    const MutexLock lock(mutex_);
    ending_ = true;
  }
  arrived_.notify_one();
  thread_.join();
}

bool WaitQueue::serve(Callback<void()> call) {
  {
    const MutexLock lock(mutex_);
    if (waiting_.size() >= kMaxWaiting) return false;
    waiting_.push_back(std::move(call));
  }
  arrived_.notify_one();
  return true;
}

void WaitQueue::run() {
  pthread_setname_np(pthread_self(), name_);
  MutexLock lock(mutex_);
  for (;;) {
    while (!ending_ && waiting_.empty()) arrived_.wait(mutex_);
    if (waiting_.empty()) return;
    Callback<void()> call = std::move(waiting_.front());
    waiting_.pop_front();
    lock.unlock();
    call();
    call = {};  // what it owns goes before the lock is taken again
    lock.lock();
  }
}

}  // namespace hapticd::server
