#pragma once

#include <filesystem>

#include "rt/loop/periodic_loop.h"
#include "server/diagnosis/finding.h"

namespace hapticd::server {

/// What the kernel and the rights of this process mean for a loop of that configuration: real-time kernel,
/// isolated CPUs, frequency governor, throttling of real-time threads, limits on priority and locked memory,
/// clock source. `root` is where /proc and /sys are found.
Findings examine_machine(const rt::LoopConfig& loop, const std::filesystem::path& root = "/");

}  // namespace hapticd::server
