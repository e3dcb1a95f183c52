#include <gtest/gtest.h>
#include <sched.h>
#include <signal.h>

#include <filesystem>
#include <fstream>
#include <map>
#include <set>

#include "server/process/ending_signals.h"
#include "tests/integration/command_record.h"
#include "tests/integration/daemon_process.h"
#include "tests/integration/running_service.h"
#include "tests/support/sanitizer.h"
#include "tests/support/temporary_folder.h"

namespace hapticd::test {
namespace {

struct Ended {
  int code;
  std::string errors;
  std::string output;
};

Ended run(std::vector<std::string> arguments) {
  DaemonProcess process(std::move(arguments));
  const int code = process.wait();
  return {code, process.errors(), process.output()};
}

void expect_ended(const Ended& ended, int code, const std::string& said) {
  EXPECT_EQ(ended.code, code) << ended.errors;
  EXPECT_NE(ended.errors.find(said), std::string::npos) << ended.errors;
}

TEST(ServiceProcess, EndsCleanlyOnSigtermAndStreamsEndFirst) {
  for (const int signal : {SIGTERM, SIGINT}) {
    DaemonProcess process({"--listen", "127.0.0.1:0", "--scene", "tap_1d"});
    const std::string address = process.await_address();
    const auto stub = v1::TelemetryService::NewStub(connect(address));
    grpc::ClientContext context;
    const auto reader = stub->Subscribe(&context, {});
    v1::TelemetryBatch batch;
    ASSERT_TRUE(reader->Read(&batch));
    process.signal(signal);
    std::uint64_t last = batch.samples(batch.samples_size() - 1).tick();
    while (reader->Read(&batch)) {
      for (const v1::TelemetrySample& sample : batch.samples()) EXPECT_EQ(sample.tick(), ++last);
    }
    EXPECT_EQ(reader->Finish().error_code(), grpc::StatusCode::UNAVAILABLE);
    EXPECT_EQ(process.wait(), 0) << process.errors();
  }
}

class EndingSignal : public testing::TestWithParam<int> {};

TEST_P(EndingSignal, TakesTheForceFirst) {
  DaemonProcess process({"--listen", "127.0.0.1:0", "--scene", "tap_1d"});
  const ServiceClient client(connect(process.await_address()));
  client.set_hand(v1::HAND_PROGRAM_KIND_PRESS, [](v1::HandProgram& press) {
    press.set_force_n(2.0);
    press.set_hold_s(-1.0);
  });
  client.await([](const v1::RigState& s) { return s.in_contact() && s.displacement_mm() > 2.0; });
  CommandRecord record(client.channel);
  record.await_tick(record.last_tick() + 50);
  process.signal(GetParam());
  const auto ticks = record.read_to_the_end();
  EXPECT_EQ(process.wait(), 0) << process.errors();
  ASSERT_FALSE(ticks.empty());
  double max_n = 0.0;
  for (const auto& [tick, command] : ticks) max_n = std::max(max_n, std::abs(command.force_n.z));
  EXPECT_GT(max_n, 0.1) << "there was a force to take away";
  const hal::Vector3& last = ticks.rbegin()->second.force_n;
  EXPECT_EQ(dot(last, last), 0.0) << "tick " << ticks.rbegin()->first;
}

INSTANTIATE_TEST_SUITE_P(All, EndingSignal,
                         testing::Values(SIGHUP, SIGQUIT, SIGTERM, SIGINT, SIGUSR2, SIGALRM, SIGXCPU, SIGPWR,
                                         SIGRTMIN),
                         [](const auto& signal) { return "Signal" + std::to_string(signal.param); });

TEST(EndingSignals, AreAllThatEndAProcessAndAreNeitherCrashesNorTheMatterOfAWrite) {
  const std::set<int> not_ending = {SIGKILL, SIGSTOP,  SIGTSTP, SIGTTIN, SIGTTOU, SIGCONT, SIGCHLD,
                                    SIGURG,  SIGWINCH, SIGSEGV, SIGABRT, SIGBUS,  SIGFPE,  SIGILL,
                                    SIGSYS,  SIGTRAP,  SIGPIPE, SIGXFSZ, SIGUSR1};
  const sigset_t ending = server::ending_signals();
  for (int signal = 1; signal <= SIGRTMAX; ++signal) {
    if (signal > SIGSYS && signal < SIGRTMIN) continue;  // the C library's own
    EXPECT_EQ(sigismember(&ending, signal) == 1, !not_ending.contains(signal))
        << server::name_of_signal(signal);
  }
}

TEST(ServiceProcess, StopsAndGoesOnAtSigusr1AndAtCtrlZ) {
  DaemonProcess process({"--listen", "127.0.0.1:0", "--scene", "tap_1d"});
  const ServiceClient client(connect(process.await_address()));
  for (const int signal : {SIGUSR1, SIGUSR1, SIGTSTP, SIGTSTP}) {
    process.signal(signal);
    EXPECT_EQ(client.await(is_latched).guard_fault(), v1::GUARD_FAULT_STOPPED);
    EXPECT_TRUE(client.clear().ok());
  }
  process.end();
  EXPECT_NE(process.errors().find("by a signal"), std::string::npos) << process.errors();
}

TEST(ServiceProcess, GoesOnAfterSignalsThatAreTheMatterOfAWriteOrOfATerminal) {
  DaemonProcess process({"--listen", "127.0.0.1:0"});
  const std::string address = process.await_address();
  for (const int signal : {SIGPIPE, SIGXFSZ, SIGTTIN, SIGTTOU}) process.signal(signal);
  EXPECT_TRUE(ServiceClient(connect(address)).state().loop().running());
  process.end();
}

TEST(ServiceProcess, ACrashIsStillACrash) {
  for (const int signal : {SIGSEGV, SIGABRT, SIGBUS, SIGFPE, SIGILL}) {
    DaemonProcess process({"--listen", "127.0.0.1:0", "--scene", "tap_1d"});
    process.await_address();
    process.signal(signal);
    EXPECT_EQ(process.wait(), -signal);
    EXPECT_NE(process.errors().find("hapticd: crashed"), std::string::npos) << process.errors();
  }
}

TEST(ServiceProcess, RefusesASceneOnItsCommandLineThatAsksForMoreThanItsGuardAllows) {
  const TemporaryFolder folder;
  folder.write("wild.toml", "name = \"wild\"\n[guard]\nmax_power_w = 50\n");
  expect_ended(run({"--scenes", folder.path(""), "--scene", "wild"}), 2,
               "scene 'wild', guard.max_power_w: more than this daemon allows (got 50 W)");
  const std::string config = folder.write("hapticd.cfg", "[guard]\nmax_power_w = 50\n");
  const Ended allowed =
      run({"--config", config, "--scenes", folder.path(""), "--scene", "wild", "--check-config"});
  EXPECT_EQ(allowed.code, 0) << allowed.errors;
  EXPECT_NE(allowed.output.find("[guard]\nmax_force_n = 0.0\n"), std::string::npos) << allowed.output;
  EXPECT_NE(allowed.output.find("max_power_w = 50.0\n"), std::string::npos) << allowed.output;
}

TEST(ServiceProcess, RefusesAConfigurationWhoseKeysAreEndless) {
  const TemporaryFolder folder;
  std::string key;
  for (int i = 0; i < 40000; ++i) key += "a.";
  const std::string config = folder.write("hapticd.toml", key + "a = 1\n");
  expect_ended(run({"--config", config}), 2, config + ", line 1: a key has too many parts");
}

TEST(ServiceProcess, RefusesAnAuditFileThatIsAnotherOfItsFiles) {
  const TemporaryFolder folder;
  const std::string socket = folder.path("d.sock");
  for (const std::string name :
       {"models.sqlite", "recordings", "incidents", "flight-0.ring", "d.sock.lock"}) {
    const std::string config =
        folder.write("hapticd.toml", "[recording]\nfolder = \"" + folder.path() +
                                         "\"\n[access]\naudit_file = \"" + folder.path(name) + "\"\n");
    expect_ended(run({"--listen", "127.0.0.1:0", "--unix", socket, "--config", config, "--model-store",
                      folder.path("models.sqlite")}),
                 2, "[access] audit_file: the audit log ");
    EXPECT_FALSE(std::filesystem::exists(folder.path("flight-0.ring"))) << "it ended in order";
  }
}

TEST(ServiceProcess, RefusesASecondDaemonOnThePort) {
  DaemonProcess first({"--listen", "127.0.0.1:0"});
  const std::string address = first.await_address();
  expect_ended(run({"--listen", address}), 3,
               "hapticd: " + address + ": cannot listen (got Address already in use)");
  v1::RigInfo info;
  EXPECT_TRUE(v1::RigService::NewStub(connect(address))->GetRigInfo(call_context().get(), {}, &info).ok());
}

TEST(ServiceProcess, RefusesASecondDaemonOnTheUnixSocketAndTakesOverFromADeadOne) {
  const TemporaryFolder folder;
  const std::string socket = folder.path("hapticd.sock");
  {
    DaemonProcess first({"--listen", "127.0.0.1:0", "--unix", socket});
    first.await_address();
    expect_ended(run({"--listen", "127.0.0.1:0", "--unix", socket}), 3,
                 socket + ": another hapticd serves this unix socket (got process " +
                     std::to_string(first.pid()) + ")");
    first.signal(SIGKILL);  // leaves socket and lock file behind
    EXPECT_EQ(first.wait(), -SIGKILL);
  }
  DaemonProcess second({"--listen", "127.0.0.1:0", "--unix", socket});
  second.await_address();
  v1::RigInfo info;
  EXPECT_TRUE(
      v1::RigService::NewStub(connect("unix:" + socket))->GetRigInfo(call_context().get(), {}, &info).ok());
}

// The network may not end: by then the force is off and what a clean end leaves is there.
TEST(ServiceProcess, LeavesTheNetworkForTheEnd) {
  const TemporaryFolder state;
  server::DaemonConfig config = quiet_config();
  config.state_folder = state.path();
  const RunningService service(config);
  service.await([](const v1::RigState& s) { return s.tick() > 10; });
  EXPECT_TRUE(std::filesystem::exists(state.path("running")));
  service.daemon->stop();
  EXPECT_FALSE(std::filesystem::exists(state.path("running")));
  const std::uint64_t last = service.state().tick();
  EXPECT_EQ(service.state().tick(), last) << "the loop has ended, and the network answers";
  service.daemon->shutdown();
}

TEST(ServiceProcess, TellsBadCommandLinesAndConfigurationsApart) {
  const TemporaryFolder folder;
  expect_ended(run({"--lisen", "127.0.0.1:0"}), 2,
               "hapticd: there is no such option (got --lisen); did you mean '--listen'?");
  expect_ended(run({"--rate", "2000"}), 2, "did you mean '--rate-hz'?");
  expect_ended(run({"--rate=2000"}), 2, "did you mean '--rate-hz'?");
  expect_ended(run({"--qqqq", "2000"}), 2, "see hapticd --help");
  expect_ended(run({"--listen", "0.0.0.0:50051"}), 2, "refusing to listen beyond this machine");
  expect_ended(run({"--rate-hz", "nan"}), 2, "--rate-hz: the loop rate is not finite");
  expect_ended(run({"--config", folder.path("none.toml")}), 2, "cannot read the file");
  const std::string config = folder.write("hapticd.toml", "[loop]\nrate_hz = 1000\ncup = 1\n");
  expect_ended(run({"--config", config}), 2, config + ", line 3: unknown key 'cup' in [loop]");
  expect_ended(run({"--scene", "tap1d"}), 2, "unknown scene 'tap1d'");
  expect_ended(run({"--scenes", folder.path("none")}), 2, "the scene folder cannot be read");
  expect_ended(run({"--models", folder.path("none")}), 2, "the model folder cannot be read");
  expect_ended(run({"--rig", "replay:/nowhere.csv"}), 4, "recording '/nowhere.csv': there is no such file");
  expect_ended(run({"--rig", "sim:phantom_9"}), 4, "unknown device");
}

/// Ends by a message, not by an abort once a thread cannot begin.
TEST(ServiceProcess, SaysThatItsAddressSpaceIsLimitedTooFar) {
  if (kSanitized) GTEST_SKIP() << "its memory is the sanitizer's";
  DaemonProcess process("--as=419430400", {"--listen", "127.0.0.1:0"});
  const int code = process.wait();
  expect_ended({code, process.errors(), process.output()}, 1,
               "the address space of this process is limited too far (got 400 MiB)");
  EXPECT_NE(process.errors().find("at least 2048 MiB"), std::string::npos) << process.errors();
  EXPECT_NE(process.errors().find("ulimit -v unlimited"), std::string::npos) << process.errors();
}

/// The stop port did not answer with 64 descriptors: the thread that stops could not wait for its
/// connections.
TEST(ServiceProcess, SaysThatItMayOpenTooFewFiles) {
  DaemonProcess process("--nofile=64", {"--listen", "127.0.0.1:0"});
  const int code = process.wait();
  expect_ended({code, process.errors(), process.output()}, 1,
               "this process may open too few files and connections (got 64)");
  EXPECT_NE(process.errors().find("at least 256"), std::string::npos) << process.errors();
}

TEST(ServiceProcess, ChecksAConfigurationAndPrintsAllOfIt) {
  const TemporaryFolder folder;
  const std::string config =
      folder.write("hapticd.toml", "[loop]\nrate_hz = 2000\n[scene]\nload = \"wall\"\n");
  const Ended ended = run({"--config", config, "--rig", "sim:phantom_1_5_high_force", "--check-config"});
  EXPECT_EQ(ended.code, 0) << ended.errors;
  for (const char* line : {"rate_hz = 2000.0\n", "device = \"phantom_1_5_high_force\"\n", "load = \"wall\"\n",
                           "listen = \"127.0.0.1:50051\"\n"}) {
    EXPECT_NE(ended.output.find(line), std::string::npos) << line << ended.output;
  }
  expect_ended(run({"--rig", "replay:/nowhere.csv", "--check-config"}), 4, "there is no such file");
  EXPECT_EQ(run({"--version"}).output.rfind("hapticd ", 0), 0U);
}

TEST(ServiceProcess, RefusesAFolderOfCertificatesThatIsNotThere) {
  const TemporaryFolder folder;
  const std::string config = folder.write("hapticd.toml", "[network]\ncertificates = \"/nofolder\"\n");
  expect_ended(run({"--config", config, "--check-config"}), 2,
               "[network] certificates: there is no such folder (got /nofolder)");
  expect_ended(run({"--certificates", config, "--check-config"}), 2, "this is not a folder");
}

TEST(ServiceProcess, WarnsOfNamesThatThisMachineDoesNotKnow) {
  const TemporaryFolder folder;
  const std::string config = folder.write("hapticd.toml", "[access.users]\nno_such_user = \"observer\"\n");
  const Ended ended = run({"--config", config, "--check-config"});
  EXPECT_EQ(ended.code, 0);
  EXPECT_NE(ended.errors.find("[access.users] names a user that this machine does not know: no_such_user"),
            std::string::npos)
      << ended.errors;
}

/// The CPUs each thread of a process may run on, as the kernel shows them, by the thread's name.
std::multimap<std::string, std::string> cpus_of_threads(pid_t pid) {
  std::multimap<std::string, std::string> cpus;
  for (const auto& thread : std::filesystem::directory_iterator("/proc/" + std::to_string(pid) + "/task")) {
    std::ifstream status(thread.path() / "status");
    std::string name;
    for (std::string line; std::getline(status, line);) {
      if (line.starts_with("Name:")) name = line.substr(6);
      if (line.starts_with("Cpus_allowed_list:")) cpus.emplace(name, line.substr(19));
    }
  }
  return cpus;
}

TEST(ServiceProcess, LeavesTheCpuOfAPinnedLoopToTheLoop) {
  cpu_set_t ours;
  ASSERT_EQ(sched_getaffinity(0, sizeof ours, &ours), 0);
  if (CPU_COUNT(&ours) < 2 || !CPU_ISSET(0, &ours)) GTEST_SKIP() << "one CPU has to be shared by all";
  const TemporaryFolder folder;
  const std::string config = folder.write("hapticd.toml", "[loop]\ncpu = 0\n");
  DaemonProcess process({"--listen", "127.0.0.1:0", "--config", config});
  const std::string address = process.await_address();
  v1::RigInfo info;  // so that threads are there that serve calls
  ASSERT_TRUE(v1::RigService::NewStub(connect(address))->GetRigInfo(call_context().get(), {}, &info).ok());
  int others = 0;
  for (const auto& [name, cpus] : cpus_of_threads(process.pid())) {
    if (name == "hapticd-loop") {
      EXPECT_EQ(cpus, "0");
    } else {
      EXPECT_NE(cpus[0], '0') << name << ": " << cpus;
      ++others;
    }
  }
  EXPECT_GT(others, 3);
}

TEST(ServiceProcess, SurvivesGarbageOnItsPort) {
  DaemonProcess process({"--listen", "127.0.0.1:0"});
  const std::string address = process.await_address();
  ChildProcess garbage("/bin/bash",
                       {"-c",
                        "exec 3<>/dev/tcp/${0%:*}/${0##*:}; head -c 100000 /dev/urandom >&3; "
                        "printf 'PRI * HTTP/2.0\\r\\n\\r\\nSM\\r\\n\\r\\n\\xff\\xff\\xff\\xff' >&3",
                        address});
  garbage.wait();
  v1::RigState state;
  EXPECT_TRUE(ok(v1::RigService::NewStub(connect(address))->GetRigState(call_context().get(), {}, &state)));
  EXPECT_TRUE(state.loop().running());
}

}  // namespace
}  // namespace hapticd::test
