// The doctor on the service: limits, groups of real-time threads, devices, disk; and the loop's watchdog.

#include "server/diagnosis/service_findings.h"

#include <gtest/gtest.h>
#include <sys/utsname.h>

#include <algorithm>
#include <atomic>
#include <fstream>
#include <thread>

#include "server/process/service_manager.h"
#include "server/session/loop_watchdog.h"
#include "tests/support/temporary_folder.h"

namespace hapticd::server {
namespace {

namespace fs = std::filesystem;

void write_text(const fs::path& path, const std::string& text) {
  fs::create_directories(path.parent_path());
  std::ofstream(path) << text;
}

std::string text_on(const Findings& findings, const std::string& topic) {
  const auto found = std::find_if(findings.begin(), findings.end(),
                                  [&topic](const Finding& finding) { return finding.topic == topic; });
  return found == findings.end() ? "" : found->text;
}

TEST(ServiceFindings, TheUnitIsKnownByItsControlGroup) {
  EXPECT_EQ(unit_of_cgroup("0::/system.slice/hapticd.service\n"), "hapticd.service");
  EXPECT_EQ(unit_of_cgroup("0::/user.slice/user-1000.slice/session-2.scope\n"), "");
  EXPECT_EQ(unit_of_cgroup("0::/user.slice/user-1000.slice/user@1000.service/app.slice/shell.scope\n"), "");
  EXPECT_EQ(unit_of_cgroup(""), "");
  const test::TemporaryFolder root;
  write_text(fs::path(root.path()) / "proc/self/cgroup", "0::/system.slice/hapticd.service\n");
  const std::string text = text_on(examine_service({}, "", root.path()), "service");
  EXPECT_TRUE(text.starts_with("run by hapticd.service; limits of the process: real-time priority ")) << text;
  EXPECT_NE(text.find("RLIMIT_RTPRIO"), std::string::npos) << text;
}

TEST(ServiceFindings, GroupsOfRealTimeThreadsAreAWarning) {
  utsname name{};
  uname(&name);
  const test::TemporaryFolder root;
  const fs::path base = root.path();
  write_text(base / "boot" / (std::string("config-") + name.release), "#\nCONFIG_RT_GROUP_SCHED=y\n");
  EXPECT_NE(text_on(examine_service({}, "", base), "scheduling").find("gets no real-time priority"),
            std::string::npos);
  write_text(base / "proc/cmdline", "quiet rt_group_sched=0");
  EXPECT_NE(text_on(examine_service({}, "", base), "scheduling").find("does not group"), std::string::npos);
}

TEST(ServiceFindings, ADeviceThatIsThereIsLookedAt) {
  const test::TemporaryFolder root;
  EXPECT_EQ(text_on(examine_service({}, "", root.path()), "rights"), "");
  write_text(fs::path(root.path()) / "dev/comedi0", "");
  EXPECT_NE(text_on(examine_service({}, "", root.path()), "rights").find("comedi0"), std::string::npos);
}

TEST(ServiceFindings, LittleSpaceIsSaid) {
  EXPECT_EQ(judge_disk_space(5000.0, "/var/lib/hapticd").severity, FindingSeverity::kGood);
  EXPECT_EQ(judge_disk_space(500.0, "/var/lib/hapticd").severity, FindingSeverity::kWarning);
  EXPECT_EQ(judge_disk_space(5.0, "/var/lib/hapticd").severity, FindingSeverity::kProblem);
}

TEST(LoopWatchdog, IsFedByProgressOnly) {
  using namespace std::chrono_literals;
  std::atomic<std::uint64_t> ticks{0};
  std::atomic<int> fed{0};
  const LoopWatchdog watchdog([&ticks] { return ticks.load(); }, [&fed] { ++fed; }, 20ms);
  const auto until = std::chrono::steady_clock::now() + 60s;
  while (fed < 5 && std::chrono::steady_clock::now() < until) {
    ++ticks;
    std::this_thread::sleep_for(2ms);
  }
  EXPECT_GE(fed, 5);
  std::this_thread::sleep_for(50ms);  // a look that was under way when the loop began to hang
  const int before = fed;
  std::this_thread::sleep_for(200ms);
  EXPECT_LE(fed, before + 1);
}

}  // namespace
}  // namespace hapticd::server
