#include "hal/openhaptics/vendor_thread.h"

#include <pthread.h>

#include <thread>
#include <utility>

#include "hal/lock/mutex.h"

namespace hapticd::openhaptics {

struct VendorThread::Shared {
  Mutex mutex;
  Condition changed;
  Callback<void()> job GUARDED_BY(mutex);
  bool busy GUARDED_BY(mutex) = false;
  bool stuck GUARDED_BY(mutex) = false;
  bool over GUARDED_BY(mutex) = false;
  std::thread thread;

  void work() {
    pthread_setname_np(pthread_self(), "hapticd-vendor");
    MutexLock lock(mutex);
    while (true) {
      while (!over && !job) changed.wait(mutex);
      if (!job) return;
      Callback<void()> present = std::exchange(job, {});
      lock.unlock();
      present();
      present = {};  // what it owns is freed before the caller learns that it is done
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
    const MutexLock lock(shared_->mutex);
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

bool VendorThread::call(Callback<void()> job, std::chrono::milliseconds timeout) {
  Shared& s = *shared_;
  const auto until = std::chrono::steady_clock::now() + timeout;
  const MutexLock lock(s.mutex);
  if (s.stuck) return false;
  s.job = std::move(job);
  s.busy = true;
  s.changed.notify_all();
  while (s.busy && s.changed.wait_until(s.mutex, until)) {
  }
  s.stuck = s.busy;
  return !s.stuck;
}

bool VendorThread::stuck() const {
  const MutexLock lock(shared_->mutex);
  return shared_->stuck;
}

}  // namespace hapticd::openhaptics
