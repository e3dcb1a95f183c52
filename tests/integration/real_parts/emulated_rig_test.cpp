// hapticd as a process on a rig of hardware: a device behind a library it loads, a sensor behind a socket,
// both kept alive by another process that can be killed.

#include <algorithm>
#include <filesystem>
#include <set>
#include <system_error>

#include "tests/integration/real_parts/emulated_rig_process.h"

namespace hapticd::test {
namespace {

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
  const std::filesystem::directory_iterator descriptors("/proc/" + std::to_string(process) + "/fd");
  return static_cast<int>(std::count_if(begin(descriptors), end(descriptors), [&](const auto& entry) {
    std::error_code gone;
    return udp.contains(std::filesystem::read_symlink(entry.path(), gone).string());
  }));
}

TEST_F(EmulatedRigProcess, AHandThatPressesFeelsTheTarget) {
  ASSERT_NO_FATAL_FAILURE(start(kPressingHand));
  v1::RigInfo info;
  ASSERT_TRUE(client->rig->GetRigInfo(call_context().get(), {}, &info).ok());
  EXPECT_EQ(info.kind(), v1::RIG_KIND_HARDWARE);
  EXPECT_TRUE(info.renders_force());
  EXPECT_EQ(info.sensor().model(), "nano17_si_25");

  ASSERT_TRUE(ok(client->load("tap_1d")));
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

  const std::set<std::string> well = topics_that_are_well();
  EXPECT_TRUE(well.contains("force sensor"));
  EXPECT_TRUE(well.contains("haptic device"));

  // Let go of on the way out: no force, no device.
  daemon->end();
  const HdPage page(page_path, HdPage::Join{});
  EXPECT_EQ(motor_force_n(), 0.0);
  const auto events = page.events();
  ASSERT_FALSE(events.empty());
  EXPECT_EQ(events.back(), emulators::HdEvent::kUnloaded);
}

TEST_F(EmulatedRigProcess, PeersThatDieTakeTheForceWithThemAndMayComeBack) {
  ASSERT_NO_FATAL_FAILURE(start(kPressingHand));
  ASSERT_TRUE(ok(client->load("tap_1d")));
  client->await([&](const v1::RigState& s) { return s.in_contact() && motor_force_n() > 0.2; });

  ASSERT_NO_FATAL_FAILURE(kill_peers());
  const v1::RigState lost = client->await(is_latched);
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

  ASSERT_NO_FATAL_FAILURE(start_peers_again(kPressingHand));
  client->await([](const v1::RigState& s) { return sensor_is(s, v1::PART_STATE_READY); });
  const v1::RigState still = client->state();
  EXPECT_TRUE(is_latched(still)) << "force came back unasked\n" << still.DebugString();
  EXPECT_EQ(motor_force_n(), 0.0);
  client->await([&](const v1::RigState&) { return clear().ok(); });
  client->await(
      [](const v1::RigState& s) { return s.in_contact() && s.guard_state() == v1::GUARD_STATE_RENDERING; });
  client->await([&](const v1::RigState&) { return motor_force_n() > 0.2; });
}

/// Crash of the rig, each on a separate device: it leaves the device open.
class EmulatedRigCrash : public EmulatedRigProcess, public testing::WithParamInterface<int> {};

TEST_P(EmulatedRigCrash, TakesTheForceAlongAndEndsByItsSignal) {
  const int signal = GetParam();
  ASSERT_NO_FATAL_FAILURE(start(kPressingHand));
  ASSERT_TRUE(ok(client->load("tap_1d")));
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
  EXPECT_TRUE(topics_that_are_well().contains("force sensor"));
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

TEST_F(EmulatedRigProcess, PeersEndWhenTheyAreReported) {
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
  EXPECT_EQ(ChildProcess(EMULATED_RIG, {"--no-such-option"}).wait(), 2);
  EXPECT_EQ(ChildProcess(EMULATED_RIG, {"--udp-port", "70000"}).wait(), 2);
}

}  // namespace
}  // namespace hapticd::test
