#include "rt/loop/loop_cpu.h"

#include <sched.h>

#include <cerrno>
#include <cstring>

namespace hapticd::rt {

std::string leave_to_the_loop(int cpu) {
  if (cpu < 0 || cpu >= CPU_SETSIZE) return {};
  cpu_set_t others;
  CPU_ZERO(&others);
  if (sched_getaffinity(0, sizeof others, &others) != 0) return std::strerror(errno);
  CPU_CLR(static_cast<std::size_t>(cpu), &others);
  if (CPU_COUNT(&others) == 0) return {};
  if (sched_setaffinity(0, sizeof others, &others) != 0) return std::strerror(errno);
  return {};
}

}  // namespace hapticd::rt
