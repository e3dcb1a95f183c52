#include "rt/loop/thread_schedule.h"

#include <sched.h>

#include <cerrno>

namespace hapticd::rt {

// The system's own calls, where 0 is the calling thread: those of pthreads take a lock.
ScheduleShortfall take_schedule(int cpu, int fifo_priority) noexcept {
  ScheduleShortfall lacking;
  if (cpu >= 0) {
    cpu_set_t set;
    CPU_ZERO(&set);
    CPU_SET(static_cast<std::size_t>(cpu), &set);
    if (sched_setaffinity(0, sizeof set, &set) != 0) lacking.cpu = errno;
  }
  if (fifo_priority > 0) {
    sched_param parameter{};
    parameter.sched_priority = fifo_priority;
    if (sched_setscheduler(0, SCHED_FIFO | SCHED_RESET_ON_FORK, &parameter) != 0) lacking.priority = errno;
  }
  return lacking;
}

std::optional<ThreadSchedule> schedule_of(pid_t thread) {
  cpu_set_t set;
  CPU_ZERO(&set);
  sched_param parameter{};
  const int policy = sched_getscheduler(thread);
  if (policy < 0 || sched_getparam(thread, &parameter) != 0 ||
      sched_getaffinity(thread, sizeof set, &set) != 0) {
    return std::nullopt;
  }
  ThreadSchedule schedule;
  if ((policy & ~SCHED_RESET_ON_FORK) == SCHED_FIFO) schedule.fifo_priority = parameter.sched_priority;
  for (int cpu = 0; cpu < CPU_SETSIZE; ++cpu) {
    if (CPU_ISSET(static_cast<std::size_t>(cpu), &set)) schedule.cpus.push_back(cpu);
  }
  return schedule;
}

}  // namespace hapticd::rt
