#pragma once

#include <filesystem>

#include "rt/loop/periodic_loop.h"
#include "server/diagnosis/finding.h"

namespace hapticd::server {

/// Examines how the kernel and the rights of this process suit a loop of that configuration: real-time
/// kernel, isolated CPUs, frequency governor, throttling of real-time threads, limits on priority and locked
/// memory, clock source. `root` is the folder of /proc and /sys.
Findings examine_machine(const rt::LoopConfig& loop, const std::filesystem::path& root = "/");

/// Examines how the thread that ticks runs, compared with what `loop` asks for. 0: none has ticked yet.
Finding examine_ticking_thread(pid_t thread, const rt::LoopConfig& loop);

}  // namespace hapticd::server
