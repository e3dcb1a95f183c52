// Locks that are waited for by a clock, as std::timed_mutex and std::shared_timed_mutex do: ThreadSanitizer
// of GCC 12 does not know these functions, but those by the time of day. Linked only under ThreadSanitizer.
#include <pthread.h>

#include <ctime>

namespace {

/// The time of day at which a clock shows `until`.
timespec time_of_day(clockid_t clock, const timespec& until) {
  constexpr long kSecond = 1'000'000'000;
  timespec shown{};
  timespec now{};
  clock_gettime(clock, &shown);
  clock_gettime(CLOCK_REALTIME, &now);
  timespec day{now.tv_sec + until.tv_sec - shown.tv_sec, now.tv_nsec + until.tv_nsec - shown.tv_nsec};
  while (day.tv_nsec < 0) {
    day.tv_nsec += kSecond;
    --day.tv_sec;
  }
  while (day.tv_nsec >= kSecond) {
    day.tv_nsec -= kSecond;
    ++day.tv_sec;
  }
  if (day.tv_sec < 0) day = {};
  return day;
}

}  // namespace

extern "C" {

int pthread_mutex_clocklock(pthread_mutex_t* mutex, clockid_t clock, const timespec* until) noexcept {
  const timespec day = time_of_day(clock, *until);
  return pthread_mutex_timedlock(mutex, &day);
}

int pthread_rwlock_clockrdlock(pthread_rwlock_t* lock, clockid_t clock, const timespec* until) noexcept {
  const timespec day = time_of_day(clock, *until);
  return pthread_rwlock_timedrdlock(lock, &day);
}

int pthread_rwlock_clockwrlock(pthread_rwlock_t* lock, clockid_t clock, const timespec* until) noexcept {
  const timespec day = time_of_day(clock, *until);
  return pthread_rwlock_timedwrlock(lock, &day);
}

}  // extern "C"
