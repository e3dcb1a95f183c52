#pragma once

#include <pthread.h>
#include <sys/resource.h>
#include <unistd.h>

#include <cstddef>
#include <fstream>

namespace hapticd::test {

/// Room for so many threads more in this process, and for no other, as long as it exists: each has a stack of
/// 1 GiB, and the address space ends after as many of them. A limit of threads would not hold for root.
class RoomForThreads {
 public:
  explicit RoomForThreads(std::size_t count) {
    pthread_getattr_default_np(&attributes_);
    getrlimit(RLIMIT_AS, &limit_);
    pthread_attr_t wide;
    pthread_getattr_default_np(&wide);
    pthread_attr_setstacksize(&wide, kStackBytes);
    pthread_setattr_default_np(&wide);
    pthread_attr_destroy(&wide);
    std::size_t pages = 0;
    std::ifstream("/proc/self/statm") >> pages;
    rlimit few = limit_;
    few.rlim_cur =
        pages * static_cast<std::size_t>(sysconf(_SC_PAGESIZE)) + count * kStackBytes + kStackBytes / 2;
    setrlimit(RLIMIT_AS, &few);
  }
  ~RoomForThreads() {
    setrlimit(RLIMIT_AS, &limit_);
    pthread_setattr_default_np(&attributes_);
    pthread_attr_destroy(&attributes_);
  }
  RoomForThreads(const RoomForThreads&) = delete;
  RoomForThreads& operator=(const RoomForThreads&) = delete;

 private:
  static constexpr std::size_t kStackBytes = std::size_t{1} << 30U;

  pthread_attr_t attributes_{};
  rlimit limit_{};
};

}  // namespace hapticd::test
