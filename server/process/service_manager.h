#pragma once

#include <chrono>
#include <optional>
#include <string>

namespace hapticd::server {

// What a service reports to systemd, which started it (Type=notify). Each does nothing if it did not.

/// Clients are served now; `status` is what systemctl shows.
void notify_ready(const std::string& status);
/// Notifies that the orderly end has begun.
void notify_stopping();
/// Ends the process unless it is called again within watchdog_timeout().
void notify_alive();
/// WatchdogSec= of the unit; nothing if it is not set.
std::optional<std::chrono::microseconds> watchdog_timeout();

/// The name of the unit that runs this process, e.g. "hapticd.service", from a text like /proc/self/cgroup;
/// empty if it is a shell or a container.
std::string unit_of_cgroup(const std::string& cgroup);

/// First folder of $STATE_DIRECTORY, which systemd sets; empty if it is not set or not absolute.
std::string state_directory();

}  // namespace hapticd::server
