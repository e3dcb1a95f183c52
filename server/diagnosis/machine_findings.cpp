#include "server/diagnosis/machine_findings.h"

#include <fmt/format.h>
#include <sys/resource.h>
#include <unistd.h>

#include <charconv>
#include <fstream>
#include <optional>
#include <set>
#include <sstream>
#include <string_view>

#include "rt/loop/thread_schedule.h"

namespace hapticd::server {

namespace {

namespace fs = std::filesystem;
using enum FindingSeverity;

/// The first line; nothing if the file does not exist.
std::optional<std::string> first_line(const fs::path& file) {
  std::ifstream stream(file);
  std::string line;
  if (!std::getline(stream, line)) return std::nullopt;
  return line;
}

Finding kernel(const fs::path& root) {
  const std::string version = first_line(root / "proc/version").value_or("unknown kernel");
  const bool real_time = first_line(root / "sys/kernel/realtime") == "1" ||
                         version.find("PREEMPT_RT") != std::string::npos ||
                         version.find("PREEMPT RT") != std::string::npos;
  if (real_time) return {kGood, "kernel", "PREEMPT_RT", ""};
  return {kWarning, "kernel", "not a real-time kernel: wake-ups may be late by milliseconds",
          "install linux-image-rt-amd64 and start it"};
}

/// CPUs of a list like "2-3,6".
std::set<int> cpus_of(const std::string& list) {
  std::set<int> cpus;
  std::istringstream stream(list);
  for (std::string part; std::getline(stream, part, ',');) {
    int first = 0;
    int last = 0;
    const char* end = part.data() + part.size();
    auto [next, failure] = std::from_chars(part.data(), end, first);
    if (failure != std::errc{}) continue;
    last = first;
    if (next != end && *next == '-') std::from_chars(next + 1, end, last);
    for (int cpu = first; cpu <= last && cpu < 4096; ++cpu) cpus.insert(cpu);
  }
  return cpus;
}

Finding isolation(const rt::LoopConfig& loop, const fs::path& root) {
  const std::string list = first_line(root / "sys/devices/system/cpu/isolated").value_or("");
  const std::set<int> isolated = cpus_of(list);
  if (isolated.empty()) {
    return {kWarning, "CPU",
            loop.cpu < 0 ? "no CPU is isolated: the loop shares its core with everything else"
                         : fmt::format("the loop has CPU {}, which is not isolated: hapticd keeps its other "
                                       "threads off, other programs may use it",
                                       loop.cpu),
            "start the kernel with isolcpus=N nohz_full=N rcu_nocbs=N and set cpu = N in [loop]"};
  }
  if (loop.cpu < 0 || !isolated.contains(loop.cpu)) {
    return {kWarning, "CPU", fmt::format("CPU {} is isolated, but the loop does not run there", list),
            fmt::format("set cpu = {} in [loop]", *isolated.begin())};
  }
  return {kGood, "CPU", fmt::format("the loop has CPU {}, which is isolated", loop.cpu), ""};
}

Finding governor(const fs::path& root) {
  std::set<std::string> governors;
  std::error_code ignored;
  for (const auto& entry : fs::directory_iterator(root / "sys/devices/system/cpu", ignored)) {
    if (const auto name = first_line(entry.path() / "cpufreq/scaling_governor")) governors.insert(*name);
  }
  if (governors.empty()) {
    return {kNote, "CPU", "no frequency governor is visible (a virtual machine, or fixed by the firmware)",
            ""};
  }
  if (governors == std::set<std::string>{"performance"}) return {kGood, "CPU", "governor performance", ""};
  return {kWarning, "CPU",
          fmt::format("governor {}: cores slow down between ticks", fmt::join(governors, ", ")),
          "cpupower frequency-set --governor performance"};
}

Finding throttling(const fs::path& root) {
  const auto runtime = first_line(root / "proc/sys/kernel/sched_rt_runtime_us");
  if (!runtime) return {kNote, "scheduling", "whether real-time threads are throttled is not visible", ""};
  if (*runtime == "-1") return {kGood, "scheduling", "real-time threads are not throttled", ""};
  return {kNote, "scheduling",
          fmt::format("real-time threads get {} µs of a second at most; the loop needs far less", *runtime),
          ""};
}

Finding priority(const rt::LoopConfig& loop) {
  if (loop.fifo_priority == 0) {
    return {kWarning, "rights", "the loop asks for no real-time priority",
            "set fifo_priority in [loop], e.g. 80"};
  }
  rlimit limit{};
  getrlimit(RLIMIT_RTPRIO, &limit);
  const bool enough =
      limit.rlim_cur == RLIM_INFINITY || limit.rlim_cur >= static_cast<rlim_t>(loop.fifo_priority);
  if (enough || geteuid() == 0)
    return {kGood, "rights", fmt::format("priority {} is allowed", loop.fifo_priority), ""};
  return {kWarning, "rights",
          fmt::format("the limit on real-time priority is {}, the loop asks for {}", limit.rlim_cur,
                      loop.fifo_priority),
          "LimitRTPRIO=99 in the service's unit, or ulimit -r 99 for the user (/etc/security/limits.d)"};
}

/// Reads a line of this process, "VmLck: 1234 kB" → 1234; 0 if there is no such line.
long process_kb(const fs::path& file, std::string_view key) {
  std::ifstream status(file);
  for (std::string line; std::getline(status, line);) {
    if (line.starts_with(key)) return std::strtol(line.c_str() + key.size(), nullptr, 10);
  }
  return 0;
}

Finding memory(const rt::LoopConfig& loop, const fs::path& root) {
  // VmLck is address space, mostly stacks and reserves without pages: it only shows whether memory is locked.
  const fs::path status = root / "proc/self/status";
  if (process_kb(status, "VmLck:") > 0) {
    const long locked_kb = process_kb(root / "proc/self/smaps_rollup", "Locked:");
    const long used_kb = process_kb(status, "VmRSS:");
    return {kGood, "memory",
            fmt::format("locked: {} MB stay in memory, of {} MB in use",
                        (locked_kb > 0 ? locked_kb : used_kb) / 1024, used_kb / 1024),
            ""};
  }
  if (!loop.lock_memory) {
    return {kWarning, "memory", "not locked, as configured: a page fault may stop the loop",
            "set lock_memory = true in [loop]"};
  }
  return {kWarning, "memory", "not locked: a page fault may stop the loop",
          "LimitMEMLOCK=infinity in the service's unit, or ulimit -l unlimited for the user"};
}

Finding clock_source(const fs::path& root) {
  const fs::path folder = root / "sys/devices/system/clocksource/clocksource0";
  const auto name = first_line(folder / "current_clocksource");
  if (!name) return {kNote, "clock", "the clock source is not visible", ""};
  if (*name == "tsc" || *name == "kvm-clock" || *name == "arch_sys_counter") {
    return {kGood, "clock", "clock source " + *name, ""};
  }
  return {kWarning, "clock",
          fmt::format("clock source {}: reading the time takes a microsecond or more", *name),
          "start the kernel with clocksource=tsc, if the machine's is stable"};
}

}  // namespace

Finding examine_ticking_thread(pid_t thread, const rt::LoopConfig& loop) {
  const auto schedule = thread == 0 ? std::nullopt : rt::schedule_of(thread);
  if (!schedule) return {kNote, "loop", "no thread ticks", ""};
  const bool has_cpu = loop.cpu < 0 || schedule->cpus == std::vector<int>{loop.cpu};
  const std::string words =
      fmt::format("the thread that ticks ({}) has {}, on CPU {}", thread,
                  schedule->fifo_priority > 0 ? fmt::format("SCHED_FIFO priority {}", schedule->fifo_priority)
                                              : std::string("ordinary priority"),
                  fmt::join(schedule->cpus, ", "));
  if (schedule->fifo_priority != loop.fifo_priority) {
    return {kWarning, "loop", fmt::format("{}; [loop] asks for priority {}", words, loop.fifo_priority),
            "LimitRTPRIO=99 in the service's unit, or ulimit -r 99 for the user (/etc/security/limits.d)"};
  }
  if (!has_cpu) {
    return {kWarning, "loop", fmt::format("{}; [loop] asks for CPU {}", words, loop.cpu),
            "check the CPU set of the process"};
  }
  return {kGood, "loop", words, ""};
}

Findings examine_machine(const rt::LoopConfig& loop, const fs::path& root) {
  return {kernel(root),   isolation(loop, root), governor(root),    throttling(root),
          priority(loop), memory(loop, root),    clock_source(root)};
}

}  // namespace hapticd::server
