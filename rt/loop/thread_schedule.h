#pragma once

#include <sys/types.h>

#include <optional>
#include <vector>

namespace hapticd::rt {

/// Why a thread does not run as it was asked to: values of errno, 0 if it does.
struct ScheduleShortfall {
  int cpu = 0;
  int priority = 0;
};

/// Pins the calling thread to a CPU (-1: leaves it on those it has) and gives it SCHED_FIFO at
/// `fifo_priority` (0: leaves it ordinary). Threads that it starts are ordinary again. Two system calls; no
/// lock, no memory.
ScheduleShortfall take_schedule(int cpu, int fifo_priority) noexcept;

/// How a thread of this process runs now.
struct ThreadSchedule {
  int fifo_priority = 0;  ///< 0 = ordinary scheduling
  std::vector<int> cpus;  ///< that it may run on
};
/// Schedule of a thread; nothing if there is no such thread.
std::optional<ThreadSchedule> schedule_of(pid_t thread);

}  // namespace hapticd::rt
