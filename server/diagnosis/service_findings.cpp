#include "server/diagnosis/service_findings.h"

#include <fmt/format.h>
#include <grp.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/statvfs.h>
#include <sys/utsname.h>
#include <unistd.h>

#include <array>
#include <fstream>
#include <sstream>

#include "server/process/service_manager.h"

namespace hapticd::server {

namespace {

namespace fs = std::filesystem;
using enum FindingSeverity;

constexpr double kEnoughMb = 1024.0;  ///< a recording of an hour at 1 kHz takes some hundred
constexpr double kTooLittleMb = 64.0;

std::string whole_text(const fs::path& file) {
  std::ifstream stream(file);
  std::ostringstream text;
  text << stream.rdbuf();
  return text.str();
}

std::string limit_text(rlim_t value, rlim_t unit, const char* name) {
  return value == RLIM_INFINITY ? std::string("unlimited") : fmt::format("{}{}", value / unit, name);
}

/// Finding on the limits of this process: if a unit runs it, the unit's, not those of a shell.
Finding limits(const rt::LoopConfig& loop, const fs::path& root) {
  rlimit priority{};
  rlimit locked{};
  getrlimit(RLIMIT_RTPRIO, &priority);
  getrlimit(RLIMIT_MEMLOCK, &locked);
  const std::string unit = unit_of_cgroup(whole_text(root / "proc/self/cgroup"));
  const std::string who = unit.empty() ? "not run by a service unit" : "run by " + unit;
  const std::string text = fmt::format(
      "{}; limits of the process: real-time priority {} (RLIMIT_RTPRIO), locked memory {} (RLIMIT_MEMLOCK){}",
      who, limit_text(priority.rlim_cur, 1, ""), limit_text(locked.rlim_cur, 1024 * 1024, " MB"),
      geteuid() == 0 ? "; as root it may exceed them" : "");
  const bool short_of_priority = priority.rlim_cur != RLIM_INFINITY && geteuid() != 0 &&
                                 priority.rlim_cur < static_cast<rlim_t>(loop.fifo_priority);
  const bool short_of_memory = loop.lock_memory && locked.rlim_cur != RLIM_INFINITY && geteuid() != 0;
  if (!short_of_priority && !short_of_memory) return {kGood, "service", text, ""};
  if (unit.empty())
    return {kWarning, "service", text, "run it as the service hapticd (docs/installation.md)"};
  return {kWarning, "service", text,
          fmt::format("systemctl edit {}: LimitRTPRIO=99 and LimitMEMLOCK=infinity below [Service]", unit)};
}

/// Checks groups of real-time threads: with them a service gets no real-time priority, whatever its limits
/// are.
Finding real_time_groups(const fs::path& root) {
  utsname name{};
  uname(&name);
  const std::string config = whole_text(root / "boot" / (std::string("config-") + name.release));
  const bool old_groups = fs::exists(root / "sys/fs/cgroup/cpu/cpu.rt_runtime_us");
  if (config.empty() && !old_groups) {
    return {kNote, "scheduling", "whether the kernel groups real-time threads is not visible", ""};
  }
  const bool built_in = old_groups || config.find("\nCONFIG_RT_GROUP_SCHED=y") != std::string::npos;
  const bool switched_off = whole_text(root / "proc/cmdline").find("rt_group_sched=0") != std::string::npos;
  if (!built_in || switched_off) {
    return {kGood, "scheduling", "the kernel does not group real-time threads (RT_GROUP_SCHED)", ""};
  }
  return {kWarning, "scheduling",
          "the kernel groups real-time threads (RT_GROUP_SCHED): a service gets no real-time priority",
          "use Debian's own kernel, or start the kernel with rt_group_sched=0"};
}

std::string group_name(gid_t group) {
  ::group entry{};
  ::group* found = nullptr;
  std::array<char, 4096> memory{};
  getgrgid_r(group, &entry, memory.data(), memory.size(), &found);
  return found != nullptr ? found->gr_name : std::to_string(group);
}

void add_node(Findings& findings, const fs::path& node, int needed) {
  struct stat status {};
  if (stat(node.c_str(), &status) != 0) return;
  if (access(node.c_str(), needed) == 0) {
    findings.push_back({kGood, "rights", node.string() + " may be used", ""});
    return;
  }
  // Root's own group: being in it does not help.
  const bool by_group = status.st_gid != 0 && (status.st_mode & S_IWGRP) != 0;
  const std::string group = group_name(status.st_gid);
  findings.push_back(
      {kWarning, "rights",
       fmt::format("{} may not be used: it belongs to group {}, mode {:o}", node.string(), group,
                   status.st_mode & 0777U),
       by_group ? fmt::format("SupplementaryGroups={} in the service's unit; then start it again", group)
                : "install the udev rules of the package hapticd (60-hapticd.rules); then udevadm trigger"});
}

void add_devices(Findings& findings, const rt::LoopConfig& loop, const fs::path& root) {
  if (loop.keep_cpu_awake) add_node(findings, root / "dev/cpu_dma_latency", W_OK);
  for (int board = 0; board < 4; ++board) {
    add_node(findings, root / fmt::format("dev/comedi{}", board), R_OK | W_OK);
  }
}

void add_disk_space(Findings& findings, const std::string& folder) {
  if (folder.empty()) return;
  struct statvfs space {};
  if (statvfs(folder.c_str(), &space) != 0) return;  // not made yet
  const double free_mb = static_cast<double>(space.f_bavail) * static_cast<double>(space.f_frsize) / 1e6;
  findings.push_back(judge_disk_space(free_mb, folder));
}

}  // namespace

Finding judge_disk_space(double free_mb, const std::string& where) {
  const std::string text = fmt::format("{:.1f} GB free in {}", free_mb / 1000.0, where);
  if (free_mb >= kEnoughMb) return {kGood, "disk", text, ""};
  return {free_mb >= kTooLittleMb ? kWarning : kProblem, "disk", text,
          fmt::format("make room: models and logs are kept there; at least {:.0f} MB", kEnoughMb)};
}

Findings examine_service(const rt::LoopConfig& loop, const std::string& state_folder, const fs::path& root) {
  Findings findings{limits(loop, root), real_time_groups(root)};
  add_devices(findings, loop, root);
  add_disk_space(findings, state_folder);
  return findings;
}

}  // namespace hapticd::server
