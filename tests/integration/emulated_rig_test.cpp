// hapticd as a process on a rig of hardware: a device behind a library it loads, a sensor behind a socket,
// both kept alive by another process that can be killed.

#include <dirent.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <stdlib.h>
#include <unistd.h>

#include <cmath>
#include <fstream>
#include <set>
#include <sstream>

#include "tests/emulators/openhaptics/page.h"
#include "tests/integration/daemon_process.h"
#include "tests/integration/running_service.h"
#include "tests/support/temporary_folder.h"

namespace hapticd::test {
namespace {

using emulators::HdPage;
using Arguments = std::vector<std::string>;

const v1::PartReport& part(const v1::RigState& state, const std::string& name) {
  for (const v1::PartReport& report : state.parts()) {
    if (report.part() == name) return report;
  }
  return v1::PartReport::default_instance();
}
bool sensor_is(const v1::RigState& state, v1::PartState wanted) {
  return part(state, "force sensor").state() == wanted;
}
bool device_is(const v1::RigState& state, v1::PartState wanted) {
  return part(state, "haptic device").state() == wanted;
}
bool latched(const v1::RigState& state) {
  return state.guard_state() == v1::GUARD_STATE_LATCHED;
}

/// The number behind "key = " in a rig file.
std::string value_of(const std::string& key, const std::string& file) {
  std::ifstream lines(file);
  for (std::string line; std::getline(lines, line);) {
    if (line.rfind(key + " = ", 0) == 0) return line.substr(key.size() + 3);
  }
  ADD_FAILURE() << "no " << key << " in " << file;
  return "0";
}

/// How many UDP sockets the kernel knows of a process.
int udp_sockets(pid_t process) {
  std::set<std::string> udp;
  for (const char* table : {"/proc/net/udp", "/proc/net/udp6"}) {
    std::ifstream lines(table);
    std::string line;
    std::getline(lines, line);  // its header
    while (std::getline(lines, line)) {
      std::istringstream columns(line);
      std::string inode;
      for (int column = 0; column < 10; ++column) columns >> inode;
      udp.insert("socket:[" + inode + "]");
    }
  }
  const std::string folder = "/proc/" + std::to_string(process) + "/fd";
  DIR* const descriptors = opendir(folder.c_str());
  if (descriptors == nullptr) {
    ADD_FAILURE() << "cannot look into " << folder;
    return -1;
  }
  int count = 0;
  while (const dirent* entry = readdir(descriptors)) {
    char target[64] = {};
    const std::string link = folder + "/" + entry->d_name;
    if (readlink(link.c_str(), target, sizeof target - 1) > 0 && udp.contains(target)) ++count;
  }
  closedir(descriptors);
  return count;
}

/// The emulators' process, and the rig file it wrote.
class EmulatedRigProcess : public testing::Test {
 protected:
  void TearDown() override { unsetenv("HD_STAND_IN_PAGE"); }

  void start_peers(Arguments arguments) {
    arguments.insert(arguments.end(), {"--page", page_path, "--write", written});
    peers = std::make_unique<ChildProcess>(EMULATED_RIG, arguments);
    ASSERT_NE(peers->read_line(), "") << "it did not start";
  }
  /// After a death: what comes back is to be found where it was.
  void start_peers_again(Arguments arguments) {
    arguments.insert(arguments.end(), {"--udp-port", value_of("rdt_port", rig_file), "--http-port",
                                       value_of("http_port", rig_file)});
    start_peers(arguments);
  }
  /// The rig file for a machine that others use too: no privileges for the loop, and nothing that a pause of
  /// half a second would make a fault of.
  void complete_rig_file() {
    std::stringstream text;
    text << std::ifstream(written).rdbuf();
    std::string rig = text.str();
    const auto add = [&rig](const std::string& section, const std::string& keys) {
      const std::size_t at = rig.find(section + "\n");
      ASSERT_NE(at, std::string::npos) << rig;
      rig.insert(at + section.size() + 1, keys);
    };
    add("[rig.netft]", "stale_after_ms = 1000\n");
    add("[rig.openhaptics]", "stall_s = 2\n");
    rig += "\n[loop]\nfifo_priority = 0\nlock_memory = false\nkeep_cpu_awake = false\n";
    rig += "\n[scene]\nfolder = \"" + folder.path() + "\"\n";
    rig +=
        "\n[guard]\nmax_target_stiffness_n_per_mm = 20\nmax_sensor_stale_after_ms = 1000\nmax_loop_gap_ms = "
        "1000\n";
    std::ofstream(rig_file) << rig;
    folder.write(
        "tap_1d.toml",
        "name = \"tap_1d\"\nkind = \"tap_1d\"\n[tool]\nmass_g = 9.35\n"
        "[target]\nstiffness_n_per_mm = 2\nmax_stiffness_n_per_mm = 20\n[structure]\ncompensation = true\n"
        "[guard]\nsensor_stale_after_ms = 1000\nloop_gap_ms = 1000\n");
    setenv("HD_STAND_IN_PAGE", page_path.c_str(), 1);
  }
  void start(const Arguments& peers_arguments, const Arguments& daemon_arguments = {}) {
    ASSERT_NO_FATAL_FAILURE(start_peers(peers_arguments));
    complete_rig_file();
    Arguments arguments{"--config", rig_file, "--listen", "127.0.0.1:0"};
    arguments.insert(arguments.end(), daemon_arguments.begin(), daemon_arguments.end());
    daemon = std::make_unique<DaemonProcess>(arguments);
    const std::string address = daemon->await_address();
    if (address.empty()) {
      daemon->wait();
      FAIL() << daemon->errors();
    }
    client = std::make_unique<ServiceClient>(connect(address));
  }
  void kill_peers() {
    peers->signal(SIGKILL);
    ASSERT_EQ(peers->wait(), -SIGKILL);
    peers = nullptr;
  }

  grpc::Status clear() const {
    v1::ClearResponse response;
    return client->safety->Clear(call_context().get(), {}, &response);
  }
  grpc::Status bias() const {
    v1::BiasForceSensorResponse response;
    return client->rig->BiasForceSensor(call_context().get(), {}, &response);
  }
  grpc::Status unload() const {
    v1::UnloadSceneResponse response;
    return client->scene->UnloadScene(call_context().get(), {}, &response);
  }
  /// Looks at the stream until `condition` holds of a sample; fails the test when it never does.
  void await_sample(const std::function<bool(const v1::TelemetrySample&)>& condition) const {
    v1::SubscribeRequest request;
    request.add_groups(v1::FIELD_GROUP_GUARD);
    const auto context = call_context();
    const auto reader = client->telemetry->Subscribe(context.get(), request);
    v1::TelemetryBatch batch;
    for (bool found = false; !found;) {
      if (!reader->Read(&batch)) {
        ADD_FAILURE() << "waited in vain; the last sample was\n"
                      << (batch.samples_size() > 0 ? batch.samples().rbegin()->DebugString() : "none");
        return;
      }
      for (const v1::TelemetrySample& sample : batch.samples()) found = found || condition(sample);
    }
    context->TryCancel();
    reader->Finish();
  }
  static double force_n(const v1::TelemetrySample& sample) {
    const v1::Vector3& force = sample.guard().device_command_n();
    return std::hypot(force.x(), force.y(), force.z());
  }
  /// What the motors really give.
  double motor_force_n() const {
    const hal::Vector3 force = HdPage(page_path, HdPage::Join{}).force_n();
    return std::sqrt(dot(force, force));
  }

  TemporaryFolder folder;
  const std::string page_path = folder.path("page");
  const std::string written = folder.path("emulated.toml");
  const std::string rig_file = folder.path("rig.toml");
  std::unique_ptr<ChildProcess> peers;
  std::unique_ptr<DaemonProcess> daemon;
  std::unique_ptr<ServiceClient> client;
};

const Arguments kHoldingHand{"--program", "press", "--force-n", "2", "--hold-s", "-1"};
const Arguments kRestingHand{"--program", "rest"};

TEST_F(EmulatedRigProcess, AHandThatPressesFeelsTheTarget) {
  ASSERT_NO_FATAL_FAILURE(start(kHoldingHand));
  v1::RigInfo info;
  ASSERT_TRUE(client->rig->GetRigInfo(call_context().get(), {}, &info).ok());
  EXPECT_EQ(info.kind(), v1::RIG_KIND_HARDWARE);
  EXPECT_TRUE(info.renders_force());
  EXPECT_EQ(info.sensor().model(), "nano17_si_25");

  const grpc::Status loaded = client->load("tap_1d");
  ASSERT_TRUE(loaded.ok()) << loaded.error_message();
  const v1::RigState touching = client->await([](const v1::RigState& s) {
    return s.in_contact() && s.hand_force_n() > 0.5 && s.guard_state() == v1::GUARD_STATE_RENDERING;
  });
  EXPECT_TRUE(sensor_is(touching, v1::PART_STATE_READY)) << touching.DebugString();
  EXPECT_TRUE(device_is(touching, v1::PART_STATE_READY)) << touching.DebugString();
  EXPECT_EQ(part(touching, "force sensor").driver(), "netft");
  EXPECT_EQ(part(touching, "haptic device").driver(), "openhaptics");
  // The object is softer than the target: the motors push back, in the command and in the world.
  await_sample([](const v1::TelemetrySample& sample) { return force_n(sample) > 0.2; });
  client->await([&](const v1::RigState&) { return motor_force_n() > 0.2; });

  // In contact there is nothing to take for zero.
  EXPECT_EQ(bias().error_code(), grpc::StatusCode::FAILED_PRECONDITION);

  v1::DiagnoseRequest probing;
  probing.set_probe(true);
  v1::Diagnosis diagnosis;
  const grpc::Status diagnosed = client->rig->Diagnose(call_context().get(), probing, &diagnosis);
  ASSERT_TRUE(diagnosed.ok()) << diagnosed.error_message();
  std::set<std::string> well;
  for (const v1::Finding& finding : diagnosis.findings()) {
    if (finding.severity() == v1::FINDING_SEVERITY_GOOD) well.insert(finding.topic());
  }
  EXPECT_TRUE(well.contains("force sensor")) << diagnosis.DebugString();
  EXPECT_TRUE(well.contains("haptic device")) << diagnosis.DebugString();

  v1::ListFaultsResponse faults;
  ASSERT_TRUE(client->safety->ListFaults(call_context().get(), {}, &faults).ok());
  std::set<int> listed;
  for (const v1::FaultRule& rule : faults.faults()) {
    listed.insert(rule.fault());
    EXPECT_FALSE(rule.cause().empty() || rule.remedy().empty()) << rule.DebugString();
  }
  EXPECT_TRUE(listed.contains(v1::GUARD_FAULT_SENSOR_LOST));
  EXPECT_TRUE(listed.contains(v1::GUARD_FAULT_DEVICE_FAULT));

  // Let go of on the way out: no force, no device.
  daemon->signal(SIGTERM);
  EXPECT_EQ(daemon->wait(), 0) << daemon->errors();
  const HdPage page(page_path, HdPage::Join{});
  EXPECT_EQ(motor_force_n(), 0.0);
  const auto events = page.events();
  ASSERT_FALSE(events.empty());
  EXPECT_EQ(events.back(), emulators::HdEvent::kUnloaded);
}

TEST_F(EmulatedRigProcess, PeersThatDieTakeTheForceWithThemAndMayComeBack) {
  ASSERT_NO_FATAL_FAILURE(start(kHoldingHand));
  const grpc::Status loaded = client->load("tap_1d");
  ASSERT_TRUE(loaded.ok()) << loaded.error_message();
  client->await([&](const v1::RigState& s) { return s.in_contact() && motor_force_n() > 0.2; });

  ASSERT_NO_FATAL_FAILURE(kill_peers());
  const v1::RigState lost = client->await(latched);
  EXPECT_TRUE(lost.guard_fault() == v1::GUARD_FAULT_SENSOR_STALE ||
              lost.guard_fault() == v1::GUARD_FAULT_SENSOR_LOST ||
              lost.guard_fault() == v1::GUARD_FAULT_DEVICE_FAULT)
      << lost.DebugString();
  client->await([&](const v1::RigState&) { return motor_force_n() == 0.0; });
  await_sample([](const v1::TelemetrySample& sample) {
    return sample.guard().state() == v1::GUARD_STATE_LATCHED && force_n(sample) == 0.0;
  });
  EXPECT_FALSE(
      sensor_is(client->await([](const v1::RigState& s) { return !sensor_is(s, v1::PART_STATE_READY); }),
                v1::PART_STATE_READY));
  EXPECT_EQ(clear().error_code(), grpc::StatusCode::FAILED_PRECONDITION);

  ASSERT_NO_FATAL_FAILURE(start_peers_again(kHoldingHand));
  client->await([](const v1::RigState& s) { return sensor_is(s, v1::PART_STATE_READY); });
  const v1::RigState still = client->state();
  EXPECT_TRUE(latched(still)) << "force came back unasked\n" << still.DebugString();
  EXPECT_EQ(motor_force_n(), 0.0);
  client->await([&](const v1::RigState&) { return clear().ok(); });
  client->await(
      [](const v1::RigState& s) { return s.in_contact() && s.guard_state() == v1::GUARD_STATE_RENDERING; });
  client->await([&](const v1::RigState&) { return motor_force_n() > 0.2; });
}

/// Each on a device of its own: a crash leaves it open.
class EmulatedRigCrash : public EmulatedRigProcess, public testing::WithParamInterface<int> {};

TEST_P(EmulatedRigCrash, TakesTheForceAlongAndEndsByItsSignal) {
  const int signal = GetParam();
  ASSERT_NO_FATAL_FAILURE(start(kHoldingHand));
  const grpc::Status loaded = client->load("tap_1d");
  ASSERT_TRUE(loaded.ok()) << loaded.error_message();
  client->await([&](const v1::RigState& s) { return s.in_contact() && motor_force_n() > 0.2; });
  daemon->signal(signal);
  EXPECT_EQ(daemon->wait(), -signal) << daemon->errors();
  EXPECT_EQ(motor_force_n(), 0.0) << "signal " << signal;
  const HdPage page(page_path, HdPage::Join{});
  ASSERT_FALSE(page.events().empty());
  EXPECT_EQ(page.events().back(), emulators::HdEvent::kZeroFrame) << "a frame without force, and the end";
}

INSTANTIATE_TEST_SUITE_P(Signals, EmulatedRigCrash, testing::Values(SIGSEGV, SIGABRT));

TEST_F(EmulatedRigProcess, TheSensorIsOpenForScenesThatListenToIt) {
  ASSERT_NO_FATAL_FAILURE(start(kRestingHand, {"--scene", "wall"}));
  EXPECT_TRUE(sensor_is(client->state(), v1::PART_STATE_IDLE)) << client->state().DebugString();
  EXPECT_EQ(udp_sockets(daemon->pid()), 0);
  EXPECT_EQ(client->state().guard_state(), v1::GUARD_STATE_RENDERING);

  ASSERT_TRUE(client->load("tap_1d").ok());
  EXPECT_TRUE(sensor_is(client->state(), v1::PART_STATE_READY)) << client->state().DebugString();
  EXPECT_GE(udp_sockets(daemon->pid()), 1);
  client->await([&](const v1::RigState&) { return bias().ok(); });  // once it is known to be free

  ASSERT_TRUE(unload().ok());
  EXPECT_TRUE(sensor_is(client->state(), v1::PART_STATE_IDLE)) << client->state().DebugString();
  EXPECT_EQ(udp_sockets(daemon->pid()), 0);

  // Looked at for the moment only.
  v1::DiagnoseRequest probing;
  probing.set_probe(true);
  v1::Diagnosis diagnosis;
  ASSERT_TRUE(client->rig->Diagnose(call_context().get(), probing, &diagnosis).ok());
  bool delivered = false;
  for (const v1::Finding& finding : diagnosis.findings()) {
    delivered |= finding.topic() == "force sensor" && finding.severity() == v1::FINDING_SEVERITY_GOOD;
  }
  EXPECT_TRUE(delivered) << diagnosis.DebugString();
  EXPECT_EQ(udp_sockets(daemon->pid()), 0);

  // A scene that needs what does not answer is refused, and leaves nothing open.
  ASSERT_NO_FATAL_FAILURE(kill_peers());
  EXPECT_EQ(client->load("tap_1d").error_code(), grpc::StatusCode::FAILED_PRECONDITION);
  EXPECT_EQ(client->state().scene(), "");
  EXPECT_EQ(udp_sockets(daemon->pid()), 0);
}

TEST_F(EmulatedRigProcess, CheckingTheFileOpensNothing) {
  ASSERT_NO_FATAL_FAILURE(start_peers(kRestingHand));
  complete_rig_file();
  for (const bool alive : {true, false}) {
    DaemonProcess check({"--config", rig_file, "--scene", "tap_1d", "--check-config"});
    EXPECT_EQ(check.wait(), 0) << check.errors();
    EXPECT_NE(check.output().find("sensor = \"netft\""), std::string::npos) << check.output();
    EXPECT_NE(check.output().find("rdt_port = " + value_of("rdt_port", rig_file)), std::string::npos)
        << check.output();
    HdPage page(page_path, HdPage::Join{});
    EXPECT_FALSE(page->loaded);
    EXPECT_TRUE(page.events().empty()) << "the library was loaded";
    if (alive) kill_peers();
    if (HasFatalFailure()) return;
  }
}

TEST_F(EmulatedRigProcess, PeersEndWhenTheyAreTold) {
  start_peers({"--seconds", "0.1"});
  EXPECT_EQ(peers->wait(), 0) << peers->errors();
  for (const int signal : {SIGINT, SIGTERM}) {
    start_peers({});
    peers->signal(signal);
    EXPECT_EQ(peers->wait(), 0) << peers->errors();
  }
  for (const Arguments& wrong : {Arguments{"--object", "brick"}, Arguments{"--program", "dance"},
                                 Arguments{"--udp-port", "70000"}, Arguments{"--force-n", "nan"}}) {
    ChildProcess refused(EMULATED_RIG, wrong);
    EXPECT_NE(refused.wait(), 0) << wrong[1];
    EXPECT_EQ(refused.output(), "");
    EXPECT_NE(refused.errors(), "");
  }
}

}  // namespace
}  // namespace hapticd::test
