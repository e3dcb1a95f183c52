#pragma once

#include <filesystem>
#include <string>

#include "rt/loop/periodic_loop.h"
#include "server/diagnosis/finding.h"

namespace hapticd::server {

/// Examines what the daemon is allowed to, as it runs: the unit that runs it and its limits, groups of
/// real-time threads in the kernel, the devices it may open and the groups that own them, and the space left
/// where it keeps its state. `state_folder`: empty if it keeps none. `root`: the folder of /proc, /sys, /dev,
/// /boot.
Findings examine_service(const rt::LoopConfig& loop, const std::string& state_folder,
                         const std::filesystem::path& root = "/");

/// Finding on a file system with so much space left; `where` is the folder it is about.
Finding judge_disk_space(double free_mb, const std::string& where);

}  // namespace hapticd::server
