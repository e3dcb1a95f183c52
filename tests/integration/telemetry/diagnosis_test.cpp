// The doctor: what it makes of a machine's files, of a part's report and of the force under a scene.

#include "server/diagnosis/diagnosis.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <fstream>
#include <memory>
#include <numbers>
#include <optional>
#include <string>
#include <utility>

#include "hal/sim/simulated_rig.h"
#include "rt/scene/compose.h"
#include "rt/scene/renderer.h"
#include "server/diagnosis/force_monitor.h"
#include "server/diagnosis/machine_findings.h"
#include "tests/support/temporary_folder.h"
#include "tests/support/texts.h"

namespace hapticd::server {
namespace {

namespace fs = std::filesystem;
using enum FindingSeverity;

/// A machine as its /proc and /sys show it.
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
  return {.cpu = cpu};
}

TEST(Doctor, KnowsARealTimeKernel) {
  EXPECT_EQ(Machine().file("sys/kernel/realtime", "1").find("kernel", {}).severity, kGood);
  EXPECT_EQ(Machine().file("proc/version", "Linux 6.1 #1 SMP PREEMPT_RT").find("kernel", {}).severity, kGood);
  const Finding ordinary = Machine().file("proc/version", "Linux 6.1 #1 SMP").find("kernel", {});
  EXPECT_EQ(ordinary.severity, kWarning);
  EXPECT_TRUE(test::holds(ordinary.remedy, "linux-image-rt"));
}

TEST(Doctor, WantsTheLoopOnAnIsolatedCpu) {
  Machine machine;
  EXPECT_EQ(machine.find("CPU", loop_on(1)).severity, kWarning);
  EXPECT_TRUE(test::holds(machine.find("CPU", loop_on(1)).text, "the loop has CPU 1, which is not isolated"));
  EXPECT_TRUE(test::holds(machine.find("CPU", loop_on(-1)).text, "shares its core"));
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
  EXPECT_TRUE(test::holds(mixed.text, "powersave"));
}

TEST(Doctor, LooksAtMemoryAndClock) {
  Machine machine;
  EXPECT_EQ(machine.find("memory", {}).severity, kWarning);
  machine.file("proc/self/status", "VmPeak: 1 kB\nVmLck:    1187840 kB\nVmRSS:    163840 kB");
  EXPECT_EQ(machine.find("memory", {}).text, "locked: 160 MB stay in memory, of 160 MB in use")
      << "not the address space, which frightens";
  const std::string source = "sys/devices/system/clocksource/clocksource0/current_clocksource";
  EXPECT_EQ(machine.find("clock", {}).severity, kNote);
  EXPECT_EQ(machine.file(source, "tsc").find("clock", {}).severity, kGood);
  EXPECT_EQ(machine.file(source, "acpi_pm").find("clock", {}).severity, kWarning);
}

TEST(Doctor, GivesEveryWarningARemedy) {
  rt::LoopConfig loop{.fifo_priority = 0, .lock_memory = false};
  for (const Finding& finding : examine_machine(loop, "/nowhere")) {
    if (finding.severity >= kWarning) {
      EXPECT_FALSE(finding.remedy.empty()) << finding.text;
    }
  }
}

TEST(Doctor, LooksAtTheThreadThatTicks) {
  rt::LoopConfig loop{.fifo_priority = 0};
  const pid_t here = gettid();
  EXPECT_EQ(examine_ticking_thread(0, loop).severity, kNote);
  EXPECT_EQ(examine_ticking_thread(here, loop).severity, kGood) << examine_ticking_thread(here, loop).text;
  loop.fifo_priority = 80;  // of which this thread has nothing
  EXPECT_EQ(examine_ticking_thread(here, loop).severity, kWarning);
  EXPECT_TRUE(test::holds(examine_ticking_thread(here, loop).text, "[loop] asks for priority 80"));
  EXPECT_FALSE(examine_ticking_thread(here, loop).remedy.empty());
  loop.fifo_priority = 0;
  loop.cpu = 4095;  // it runs on others
  EXPECT_EQ(examine_ticking_thread(here, loop).severity, kWarning);
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
  EXPECT_TRUE(test::holds(examine_part(report).front().text, "10.0.0.2"));
  report.state = hal::PartState::kIdle;
  EXPECT_EQ(examine_part(report).front().severity, kNote);
}

TEST(Doctor, NamesTheFaultThatTheGuardIsLatchedBy) {
  rt::TickRecord record;
  record.guard_state = rt::GuardState::kRendering;
  EXPECT_TRUE(examine_guard(record, {}).empty());
  record.guard_state = rt::GuardState::kLatched;
  record.guard_fault = rt::GuardFault::kSensorStale;
  const Findings found = examine_guard(record, {});
  ASSERT_EQ(found.size(), 1U);
  EXPECT_EQ(found[0].severity, kProblem);
  EXPECT_TRUE(test::holds(found[0].text, "latched, sensor_stale"));
  EXPECT_TRUE(test::holds(found[0].remedy, "then hapticctl clear"));
}

TEST(Doctor, NamesTheDevicesLastFaultAndDoesNotSendToItself) {
  rt::TickRecord record;
  record.guard_state = rt::GuardState::kLatched;
  record.guard_fault = rt::GuardFault::kDeviceFault;
  hal::PartReport device{"haptic device", "openhaptics", hal::PartState::kReady, "", {}, {}};
  device.last_fault = "HD_COMM_ERROR, 12 s ago: check cable and power";
  for (const std::vector<hal::PartReport>& reports : {std::vector<hal::PartReport>{}, {device}}) {
    const Findings found = examine_guard(record, reports);
    ASSERT_EQ(found.size(), 1U);
    EXPECT_EQ(found[0].remedy.find("doctor"), std::string::npos) << found[0].remedy;
    EXPECT_EQ(found[0].text.find("HD_COMM_ERROR, 12 s ago") != std::string::npos, !reports.empty())
        << found[0].text;
  }
}

/// A scene on a simulated rig, in virtual time, and what the doctor sees of its force.
class Bench {
 public:
  explicit Bench(const hal::Quaternion& sensor_to_tool = {}) {
    sim::SimulationConfig config;
    config.object = "rubber_ball";  // a sponge relaxes: the device soon bears most of the press
    config.sensor_to_tool = sensor_to_tool;
    rig_ = std::move(*sim::SimulatedRig::create(config));
    rt::SceneSpec spec;
    spec.target.stiffness_n_per_mm = 0.5;
    spec_ = *rt::resolve(spec, rig_->info());
    pipeline_ = std::move(*rt::compose(spec_, rig_->info()));
    renderer_.emplace(spec_.guard, rig_->info().rate_hz);
    renderer_->exchange(pipeline_.get(), spec_.guard);
  }

  /// The next ticks; `change` sees each record before the doctor does.
  template <class Change>
  Findings watch(double seconds, Change change) {
    ForceMonitor watch(spec_);
    for (int tick = 0; tick < static_cast<int>(seconds * 1000.0); ++tick) {
      hal::RigSample sample;
      rig_->read(sample);
      rt::TickRecord record;
      rig_->write(renderer_->tick(sample, record));
      change(record);
      watch.add(record);
    }
    return watch.findings();
  }
  Findings watch(double seconds) {
    return watch(seconds, [](rt::TickRecord&) {});
  }
  /// Half a second, while the hand presses with 2 N.
  Findings watch_pressed() {
    press();
    watch(8.0);
    return watch(0.5);
  }
  void press() {
    sim::HandProgram press{.kind = sim::HandProgram::Kind::kPress, .force_n = 2.0, .hold_s = -1.0};
    EXPECT_FALSE(rig_->set_program(press).has_value());
  }

 private:
  std::unique_ptr<sim::SimulatedRig> rig_;
  rt::SceneSpec spec_;
  std::unique_ptr<rt::Pipeline> pipeline_;
  std::optional<rt::Renderer> renderer_;
};

/// About x.
hal::Quaternion turned_by(double degrees) {
  const double half_rad = 0.5 * degrees * std::numbers::pi / 180.0;
  return {std::cos(half_rad), std::sin(half_rad), 0.0, 0.0};
}

TEST(DoctorOfForce, IsContentWithAForceAlongThePressAxis) {
  const Findings found = Bench().watch_pressed();
  ASSERT_EQ(found.size(), 1U) << found.front().text;
  EXPECT_EQ(found.front().severity, kGood) << found.front().text;
  EXPECT_TRUE(test::holds(found.front().text, "follows the press axis"));
}

TEST(DoctorOfForce, FindsASensorWhoseAxesAreTurned) {
  struct Case {
    double turned_deg;
    const char* direction;  ///< in which an upward force is read
    const char* verdict;
  };
  for (const Case& turned : {Case{90.0, "(0.00, 1.00,", "90° off"}, Case{-90.0, "(0.00, -1.00,", "90° off"},
                             Case{180.0, "-1.00)", "the wrong sign"}}) {
    const Findings found = Bench(turned_by(turned.turned_deg)).watch_pressed();
    ASSERT_FALSE(found.empty());
    const Finding& finding = found.back();
    EXPECT_EQ(finding.severity, kProblem) << finding.text;
    EXPECT_TRUE(test::holds(finding.text, "does not follow the press axis (0.00, 0.00, -1.00)"));
    EXPECT_TRUE(test::holds(finding.text, turned.direction));
    EXPECT_TRUE(test::holds(finding.text, turned.verdict));
    EXPECT_TRUE(test::holds(finding.remedy, "rig file"));
  }
}

TEST(DoctorOfForce, ToleratesWhatFrictionAndSlantDo) {
  EXPECT_EQ(Bench(turned_by(30.0)).watch_pressed().back().severity, kGood);
  EXPECT_EQ(Bench(turned_by(60.0)).watch_pressed().back().severity, kProblem);
}

TEST(DoctorOfForce, SaysHowToCheckWhereNothingIsPressed) {
  const Findings found = Bench(turned_by(90.0)).watch(0.5);
  ASSERT_EQ(found.size(), 1U);
  EXPECT_EQ(found.front().severity, kNote);
  EXPECT_TRUE(test::holds(found.front().remedy, "until the sensor reads more than 0.5 N"));
}

TEST(DoctorOfForce, DoesNotTakeTheLoadOfAnUnbiasedSensorForAPress) {
  const Findings found = Bench().watch(0.5, [](rt::TickRecord& record) {
    record.bias_serial = 0;
    record.sensor_force_n.y += 3.0;
  });
  ASSERT_EQ(found.size(), 1U) << found.back().text;
  EXPECT_EQ(found.front().severity, kWarning);
  EXPECT_TRUE(test::holds(found.front().text, "never biased"));
  EXPECT_TRUE(test::holds(found.front().remedy, "hapticctl sensor bias"));
}

TEST(DoctorOfForce, TellsOfAZeroThatHasMovedFar) {
  const auto far = [](rt::GuardFault fault) {
    return Bench().watch(0.5, [fault](rt::TickRecord& record) {
      record.faults_present |= rt::set_of(fault);
      record.zero.force_n.x = record.sensor_force_n.x = 0.15;
    });
  };
  const Findings warned = far(rt::GuardFault::kSensorZeroFar);
  EXPECT_EQ(warned.front().severity, kWarning);
  EXPECT_TRUE(test::holds(warned.front().text, "0.150 N since the bias; it is followed up to 0.25 N"));
  EXPECT_EQ(far(rt::GuardFault::kSensorZeroLost).front().severity, kProblem);
}

TEST(DoctorOfForce, TellsOfContactsThatWereTakenBack) {
  const Findings found = Bench().watch(0.5, [](rt::TickRecord& record) {
    record.contact_count = 5;
    record.withdrawn_count = 3;
  });
  EXPECT_EQ(found.front().severity, kNote);
  EXPECT_TRUE(test::holds(found.front().text, "3 of 5 contacts"));
  EXPECT_TRUE(test::holds(found.front().remedy, "tool's mass"));
}

TEST(DoctorOfForce, FindsThatNoForceReachesTheScene) {
  const Findings found =
      Bench().watch(0.5, [](rt::TickRecord& record) { record.channels = rt::channel::kSample; });
  ASSERT_EQ(found.size(), 1U);
  EXPECT_EQ(found.front().severity, kProblem);
}

}  // namespace
}  // namespace hapticd::server
