#include "hal/openhaptics/vendor_thread.h"

#include <condition_variable>
#include <mutex>
#include <thread>
#include <utility>

namespace hapticd::openhaptics {

struct VendorThread::Shared {
  std::mutex mutex;
  std::condition_variable changed;
  std::function<void()> job;
  bool busy = false;
  bool stuck = false;
  bool over = false;
  std::thread thread;

  void work() {
    std::unique_lock lock(mutex);
    while (true) {
      changed.wait(lock, [this] { return over || job; });
      if (!job) return;
      std::function<void()> present = std::exchange(job, nullptr);
      lock.unlock();
      present();
      present = nullptr;  // what it owns goes before the caller is reported
      lock.lock();
      busy = false;
      changed.notify_all();
    }
  }
};

VendorThread::VendorThread() : shared_(std::make_shared<Shared>()) {
  shared_->thread = std::thread([shared = shared_] { shared->work(); });
}

VendorThread::~VendorThread() {
  bool stuck = false;
  {
    const std::lock_guard lock(shared_->mutex);
    shared_->over = true;
    stuck = shared_->busy;
  }
  shared_->changed.notify_all();
  if (stuck) {
    shared_->thread.detach();
  } else {
    shared_->thread.join();
  }
}

bool VendorThread::call(std::function<void()> job, std::chrono::milliseconds timeout) {
  std::unique_lock lock(shared_->mutex);
  if (shared_->stuck) return false;
  shared_->job = std::move(job);
  shared_->busy = true;
  shared_->changed.notify_all();
  shared_->stuck = !shared_->changed.wait_for(lock, timeout, [this] { return !shared_->busy; });
  return !shared_->stuck;
}

bool VendorThread::stuck() const {
  const std::lock_guard lock(shared_->mutex);
  return shared_->stuck;
}

}  // namespace hapticd::openhaptics
