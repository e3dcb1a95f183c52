// The doctor: what it makes of a machine's files and of a part's report.

#include "server/diagnosis/diagnosis.h"

#include <gtest/gtest.h>

#include <fstream>
#include <string>

#include "server/diagnosis/machine_findings.h"
#include "tests/support/temporary_folder.h"

namespace hapticd::server {
namespace {

namespace fs = std::filesystem;
using enum FindingSeverity;

/// A machine as its /proc and /sys tell of it.
class Machine {
 public:
  Machine& file(const std::string& path, const std::string& text) {
    const fs::path whole = fs::path(folder_.path()) / path;
    fs::create_directories(whole.parent_path());
    std::ofstream(whole) << text << "\n";
    return *this;
  }
  Finding find(const std::string& topic, const rt::LoopConfig& loop, std::size_t nth = 0) const {
    for (const Finding& finding : examine_machine(loop, folder_.path())) {
      if (finding.topic == topic && nth-- == 0) return finding;
    }
    ADD_FAILURE() << "nothing on " << topic;
    return {};
  }

 private:
  test::TemporaryFolder folder_;
};

rt::LoopConfig loop_on(int cpu) {
  rt::LoopConfig loop;
  loop.cpu = cpu;
  return loop;
}

TEST(Doctor, KnowsARealTimeKernel) {
  EXPECT_EQ(Machine().file("sys/kernel/realtime", "1").find("kernel", {}).severity, kGood);
  EXPECT_EQ(Machine().file("proc/version", "Linux 6.1 #1 SMP PREEMPT_RT").find("kernel", {}).severity, kGood);
  const Finding ordinary = Machine().file("proc/version", "Linux 6.1 #1 SMP").find("kernel", {});
  EXPECT_EQ(ordinary.severity, kWarning);
  EXPECT_NE(ordinary.remedy.find("linux-image-rt"), std::string::npos);
}

TEST(Doctor, WantsTheLoopOnAnIsolatedCpu) {
  Machine machine;
  EXPECT_EQ(machine.find("CPU", loop_on(1)).severity, kWarning);
  EXPECT_NE(machine.find("CPU", loop_on(1)).text.find("the loop has CPU 1, which is not isolated"),
            std::string::npos);
  EXPECT_NE(machine.find("CPU", loop_on(-1)).text.find("shares its core"), std::string::npos);
  machine.file("sys/devices/system/cpu/isolated", "2-3,6");
  EXPECT_EQ(machine.find("CPU", loop_on(3)).severity, kGood);
  EXPECT_EQ(machine.find("CPU", loop_on(6)).severity, kGood);
  for (const int cpu : {-1, 0, 4}) {
    const Finding elsewhere = machine.find("CPU", loop_on(cpu));
    EXPECT_EQ(elsewhere.severity, kWarning) << cpu;
    EXPECT_EQ(elsewhere.remedy, "set cpu = 2 in [loop]");
  }
  EXPECT_EQ(Machine().file("sys/devices/system/cpu/isolated", "nonsense-,x").find("CPU", loop_on(0)).severity,
            kWarning);
}

TEST(Doctor, WantsTheGovernorPerformance) {
  EXPECT_EQ(Machine().find("CPU", {}, 1).severity, kNote) << "none is visible";
  Machine machine;
  machine.file("sys/devices/system/cpu/cpu0/cpufreq/scaling_governor", "performance");
  EXPECT_EQ(machine.find("CPU", {}, 1).severity, kGood);
  machine.file("sys/devices/system/cpu/cpu1/cpufreq/scaling_governor", "powersave");
  const Finding mixed = machine.find("CPU", {}, 1);
  EXPECT_EQ(mixed.severity, kWarning);
  EXPECT_NE(mixed.text.find("powersave"), std::string::npos);
}

TEST(Doctor, LooksAtMemoryAndClock) {
  Machine machine;
  EXPECT_EQ(machine.find("memory", {}).severity, kWarning);
  machine.file("proc/self/status", "VmPeak: 1 kB\nVmLck:    20480 kB");
  EXPECT_EQ(machine.find("memory", {}).text, "20 MB are locked");
  const std::string source = "sys/devices/system/clocksource/clocksource0/current_clocksource";
  EXPECT_EQ(machine.find("clock", {}).severity, kNote);
  EXPECT_EQ(machine.file(source, "tsc").find("clock", {}).severity, kGood);
  EXPECT_EQ(machine.file(source, "acpi_pm").find("clock", {}).severity, kWarning);
}

TEST(Doctor, GivesEveryWarningARemedy) {
  rt::LoopConfig loop;
  loop.fifo_priority = 0;
  loop.lock_memory = false;
  for (const Finding& finding : examine_machine(loop, "/nowhere")) {
    if (finding.severity >= kWarning) {
      EXPECT_FALSE(finding.remedy.empty()) << finding.text;
    }
  }
}

TEST(Doctor, SaysHowAPartFares) {
  hal::PartReport report{"force sensor", "netft", hal::PartState::kReady, "udp 10.0.0.2:49152", {}, {}};
  EXPECT_EQ(examine_part(report).front().severity, kGood);
  report.findings = {"the filter is off"};
  ASSERT_EQ(examine_part(report).size(), 2U);
  EXPECT_EQ(examine_part(report).back().severity, kWarning);
  report.state = hal::PartState::kFaulty;
  EXPECT_EQ(examine_part(report).back().severity, kProblem);
  report.state = hal::PartState::kConnecting;
  EXPECT_EQ(examine_part(report).front().severity, kProblem);
  EXPECT_NE(examine_part(report).front().text.find("10.0.0.2"), std::string::npos);
  report.state = hal::PartState::kIdle;
  EXPECT_EQ(examine_part(report).front().severity, kNote);
}

}  // namespace
}  // namespace hapticd::server
