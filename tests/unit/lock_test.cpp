#include <gtest/gtest.h>

#include <chrono>
#include <thread>

#include "hal/lock/callback.h"
#include "hal/lock/mutex.h"

namespace hapticd {
namespace {

using std::chrono::milliseconds;
using std::chrono::steady_clock;

TEST(Condition, WakesWhoWaitsAndReturnsWhenItsTimeIsOver) {
  Mutex mutex;
  Condition changed;
  bool there = false;
  std::thread other([&] {
    const MutexLock lock(mutex);
    there = true;
    changed.notify_all();
  });
  {
    const MutexLock lock(mutex);
    while (!there) changed.wait(mutex);
    const auto until = steady_clock::now() + milliseconds(1);
    while (changed.wait_until(mutex, until)) {
    }
    EXPECT_GE(steady_clock::now(), until);
    EXPECT_TRUE(there) << "the lock is held again";
  }
  other.join();
}

TEST(MutexLock, MayBeLetGoAndTakenAgain) {
  Mutex mutex;
  MutexLock lock(mutex);
  lock.unlock();
  std::thread([&] { const MutexLock meanwhile(mutex); }).join();
  lock.lock();
}

TEST(SerialMutex, IsWaitedForUntilATime) {
  SerialMutex mutex;
  const MutexLock held(mutex);
  std::thread([&] {
    if (!mutex.try_lock_until(steady_clock::now() + milliseconds(1))) return;
    mutex.unlock();
    ADD_FAILURE() << "it is held";
  }).join();
}

TEST(SharedSerialMutex, HasManyHoldersOrOne) {
  SharedSerialMutex mutex;
  if (!mutex.try_lock_shared_until(steady_clock::now())) FAIL() << "no one holds it";
  std::thread([&] {
    const auto soon = steady_clock::now() + milliseconds(1);
    if (mutex.try_lock_until(soon)) {
      mutex.unlock();
      ADD_FAILURE() << "it is shared";
    }
    if (mutex.try_lock_shared_until(soon + milliseconds(1))) {
      mutex.unlock_shared();
    } else {
      ADD_FAILURE() << "others may share it";
    }
  }).join();
  mutex.unlock_shared();
}

TEST(Callback, CallsWhatItWasGiven) {
  Callback<int(int)> twice;
  EXPECT_FALSE(twice);
  twice = [](int value) { return 2 * value; };
  ASSERT_TRUE(twice);
  EXPECT_EQ(twice(21), 42);
}

TEST(CallbackDeathTest, EndsTheProcessUnderALock) {
  if (HAPTICD_COUNTS_LOCKS == 0) GTEST_SKIP() << "this build does not count locks";
  Mutex mutex;
  Condition changed;
  const Callback<void()> call = [] {};
  call();
  {
    MutexLock lock(mutex);
    changed.wait_for(mutex, milliseconds(1));
    EXPECT_DEATH(call(), "a call-back was called under 1 locks");
    lock.unlock();
    call();
    lock.lock();
  }
  SerialMutex serial;
  const MutexLock lock(serial);
  call();  // that one may be held for long
}

}  // namespace
}  // namespace hapticd
