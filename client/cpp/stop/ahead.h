#pragma once

// Internal to the library.

#include <cstdint>

namespace hapticd::client {

/// Runs this thread, and those that it starts meanwhile, ahead of what floods the processors of this machine:
/// with a real-time priority if this user may have one, else with the shortest slices, which Linux from 6.12
/// on grants before the longer ones of others.
class Ahead {
 public:
  Ahead() noexcept;
  ~Ahead();
  Ahead(const Ahead&) = delete;
  Ahead& operator=(const Ahead&) = delete;

 private:
  /// Scheduling of a thread as the kernel's call reads and writes it (sched_attr, first version).
  struct Schedule {
    std::uint32_t size = sizeof(Schedule);
    std::uint32_t policy = 0;
    std::uint64_t flags = 0;
    std::int32_t nice = 0;
    std::uint32_t priority = 0;
    std::uint64_t slice_ns = 0;
    std::uint64_t deadline_ns = 0;
    std::uint64_t period_ns = 0;
  };
  static bool set(Schedule schedule) noexcept;

  Schedule before_;
  bool is_raised_ = false;
};

}  // namespace hapticd::client
