#include "server/process/service_manager.h"

#include <systemd/sd-daemon.h>

#include <algorithm>
#include <cstdlib>

namespace hapticd::server {

void notify_ready(const std::string& status) {
  sd_notify(0, ("READY=1\nSTATUS=" + status).c_str());
}

void notify_stopping() {
  sd_notify(0, "STOPPING=1\nSTATUS=force is zero; closing connections");
}

void notify_alive() {
  sd_notify(0, "WATCHDOG=1");
}

std::optional<std::chrono::microseconds> watchdog_timeout() {
  std::uint64_t microseconds = 0;
  if (sd_watchdog_enabled(0, &microseconds) <= 0) return std::nullopt;
  constexpr std::uint64_t kLongest = std::chrono::microseconds(std::chrono::hours(1)).count();
  return std::chrono::microseconds(std::min(microseconds, kLongest));
}

std::string unit_of_cgroup(const std::string& cgroup) {
  constexpr std::string_view kService = ".service";
  const std::size_t end = cgroup.rfind(kService);
  if (end == std::string::npos) return {};
  // A shell of a user runs below user@1000.service: that is not its unit.
  const std::size_t begin = cgroup.rfind('/', end) + 1;
  const std::string name = cgroup.substr(begin, end + kService.size() - begin);
  return name.starts_with("user@") ? std::string() : name;
}

std::string state_directory() {
  const char* value =
      std::getenv("STATE_DIRECTORY");  // NOLINT(concurrency-mt-unsafe): before there are threads
  const std::string list = value != nullptr ? value : "";
  return list.starts_with('/') ? list.substr(0, list.find(':')) : std::string();
}

}  // namespace hapticd::server
