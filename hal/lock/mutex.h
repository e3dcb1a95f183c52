#pragma once

#include <chrono>
#include <condition_variable>
#include <mutex>
#include <shared_mutex>

#include "hal/lock/held_locks.h"
#include "hal/lock/thread_annotations.h"

// The locks of all layers. docs/threads.md lists each one with what it guards and in which order it is taken.

namespace hapticd {

/// Guards data, for as long as it takes to copy or change them: the thread that holds one waits for nothing
/// but a Condition of it and calls no Callback. Not recursive.
class CAPABILITY("mutex") Mutex {
 public:
  void lock() ACQUIRE() {
    mutex_.lock();
    note_lock(1);
  }
  void unlock() RELEASE() {
    note_lock(-1);
    mutex_.unlock();
  }

 private:
  friend class Condition;
  std::mutex mutex_;
};

/// Lets one caller after the other through an operation that may take seconds: hardware is opened, a scene is
/// exchanged, a file is written. Guards what only such operations change. No tick and no stop ever takes one.
/// Not recursive.
class CAPABILITY("mutex") SerialMutex {
 public:
  void lock() ACQUIRE() { mutex_.lock(); }
  bool try_lock_until(std::chrono::steady_clock::time_point until) TRY_ACQUIRE(true) {
    return mutex_.try_lock_until(until);
  }
  void unlock() RELEASE() { mutex_.unlock(); }

 private:
  std::timed_mutex mutex_;
};

/// SerialMutex with shared holders: an operation that has it alone waits for them, and they for it.
class CAPABILITY("mutex") SharedSerialMutex {
 public:
  void lock() ACQUIRE() { mutex_.lock(); }
  bool try_lock_until(std::chrono::steady_clock::time_point until) TRY_ACQUIRE(true) {
    return mutex_.try_lock_until(until);
  }
  void unlock() RELEASE() { mutex_.unlock(); }
  bool try_lock_shared_until(std::chrono::steady_clock::time_point until) TRY_ACQUIRE_SHARED(true) {
    return mutex_.try_lock_shared_until(until);
  }
  void unlock_shared() RELEASE_SHARED() { mutex_.unlock_shared(); }

 private:
  std::shared_timed_mutex mutex_;
};

/// Holds a lock from its construction to the end of its scope. In between it may be let go and taken again.
template <class Lockable>
class SCOPED_CAPABILITY MutexLock {
 public:
  explicit MutexLock(Lockable& mutex) ACQUIRE(mutex) : mutex_(mutex) { mutex_.lock(); }
  /// Holds a lock that the caller has taken.
  MutexLock(Lockable& mutex, std::adopt_lock_t) REQUIRES(mutex) : mutex_(mutex) {}
  ~MutexLock() RELEASE() {
    if (held_) mutex_.unlock();
  }
  MutexLock(const MutexLock&) = delete;
  MutexLock& operator=(const MutexLock&) = delete;

  void unlock() RELEASE() {
    held_ = false;
    mutex_.unlock();
  }
  void lock() ACQUIRE() {
    mutex_.lock();
    held_ = true;
  }

 private:
  Lockable& mutex_;
  bool held_ = true;
};

/// Lets threads that hold a Mutex wait for a change of what it guards. Waking up says nothing about the
/// change: the caller looks, in a loop.
class Condition {
 public:
  void wait(Mutex& mutex) REQUIRES(mutex) {
    Waiting waiting(mutex);
    changed_.wait(waiting.lock);
  }
  /// False when the time is over.
  bool wait_until(Mutex& mutex, std::chrono::steady_clock::time_point until) REQUIRES(mutex) {
    Waiting waiting(mutex);
    return changed_.wait_until(waiting.lock, until) == std::cv_status::no_timeout;
  }
  template <class Rep, class Period>
  bool wait_for(Mutex& mutex, std::chrono::duration<Rep, Period> time) REQUIRES(mutex) {
    return wait_until(mutex, std::chrono::steady_clock::now() +
                                 std::chrono::ceil<std::chrono::steady_clock::duration>(time));
  }
  void notify_one() noexcept { changed_.notify_one(); }
  void notify_all() noexcept { changed_.notify_all(); }

 private:
  /// The mutex as the standard's condition variable takes it; while it waits, the thread holds it no more.
  struct Waiting {
    explicit Waiting(Mutex& mutex) : lock(mutex.mutex_, std::adopt_lock) { note_lock(-1); }
    ~Waiting() {
      lock.release();
      note_lock(1);
    }
    Waiting(const Waiting&) = delete;
    Waiting& operator=(const Waiting&) = delete;
    std::unique_lock<std::mutex> lock;
  };
  std::condition_variable changed_;
};

}  // namespace hapticd
