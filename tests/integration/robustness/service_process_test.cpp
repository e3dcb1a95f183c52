// The daemon as a service manager meets it: what it reports, how it starts after a crash, what memory it
// takes.

#include <gtest/gtest.h>
#include <signal.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>

#include <array>
#include <cstdlib>
#include <filesystem>

#include "tests/integration/daemon_process.h"
#include "tests/integration/running_service.h"
#include "tests/support/process_memory.h"
#include "tests/support/sanitizer.h"
#include "tests/support/temporary_folder.h"

namespace hapticd::test {
namespace {

namespace fs = std::filesystem;

/// A variable of the environment that child processes inherit, until the end of its scope.
class EnvironmentVariable {
 public:
  EnvironmentVariable(const char* name, const std::string& value) : name_(name) {
    setenv(name, value.c_str(), 1);
  }
  ~EnvironmentVariable() { unsetenv(name_); }
  EnvironmentVariable(const EnvironmentVariable&) = delete;
  EnvironmentVariable& operator=(const EnvironmentVariable&) = delete;

 private:
  const char* name_;
};

/// The socket on which a service manager listens.
class ListeningManager {
 public:
  explicit ListeningManager(const std::string& path)
      : descriptor_(socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC, 0)) {
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    path.copy(address.sun_path, sizeof address.sun_path - 1);
    EXPECT_EQ(bind(descriptor_, reinterpret_cast<const sockaddr*>(&address), sizeof address), 0);
    const timeval timeout{.tv_sec = kTimeout.count(), .tv_usec = 0};
    setsockopt(descriptor_, SOL_SOCKET, SO_RCVTIMEO, &timeout, sizeof timeout);
  }
  ~ListeningManager() { close(descriptor_); }
  ListeningManager(const ListeningManager&) = delete;
  ListeningManager& operator=(const ListeningManager&) = delete;

  /// Whether a message with this text comes; others before it are passed over.
  bool hears(const std::string& text) const {
    std::array<char, 1024> message{};
    for (ssize_t n = 0; (n = recv(descriptor_, message.data(), message.size(), 0)) > 0;) {
      if (std::string(message.data(), static_cast<std::size_t>(n)).find(text) != std::string::npos)
        return true;
    }
    return false;
  }

  /// Sends it messages until it takes no more.
  static void fill(const std::string& path) {
    const int other = socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    path.copy(address.sun_path, sizeof address.sun_path - 1);
    while (sendto(other, "X=1", 3, 0, reinterpret_cast<const sockaddr*>(&address), sizeof address) == 3) {
    }
    close(other);
  }

 private:
  int descriptor_;
};

const std::vector<std::string> kPlainService = {"--listen", "127.0.0.1:0", "--scene", "tap_1d"};

TEST(ServiceManager, HearsReadyAliveAndStopping) {
  const TemporaryFolder folder;
  const ListeningManager manager(folder.path() + "/notify");
  const EnvironmentVariable address("NOTIFY_SOCKET", folder.path() + "/notify");
  const EnvironmentVariable watchdog("WATCHDOG_USEC", "400000");
  DaemonProcess daemon(kPlainService);
  EXPECT_TRUE(manager.hears("READY=1"));
  for (int i = 0; i < 3; ++i) EXPECT_TRUE(manager.hears("WATCHDOG=1"));
  daemon.signal(SIGTERM);
  EXPECT_TRUE(manager.hears("STOPPING=1"));
  EXPECT_EQ(daemon.wait(), 0);
}

// Its queue holds some ten messages; the eleventh waits, for ever if it does not read.
TEST(ServiceManager, ThatDoesNotReadHoldsUpNoSignal) {
  const TemporaryFolder folder;
  const ListeningManager manager(folder.path() + "/notify");
  ListeningManager::fill(folder.path() + "/notify");
  const EnvironmentVariable address("NOTIFY_SOCKET", folder.path() + "/notify");
  const EnvironmentVariable watchdog("WATCHDOG_USEC", "400000");
  DaemonProcess daemon(kPlainService);
  daemon.await_address();
  daemon.end();
}

v1::GuardFault latched_by(const ServiceClient& client) {
  const v1::RigState state = client.await([](const v1::RigState& s) { return s.tick() > 10; });
  return state.guard_state() == v1::GUARD_STATE_LATCHED ? state.guard_fault() : v1::GUARD_FAULT_NONE;
}

TEST(AfterACrash, TheDaemonStartsWithoutForceUntilSomeoneClears) {
  const TemporaryFolder state;
  const EnvironmentVariable folder("STATE_DIRECTORY", state.path());
  const fs::path marker = fs::path(state.path()) / "running";
  {
    DaemonProcess first(kPlainService);
    EXPECT_EQ(latched_by(ServiceClient(connect(first.await_address()))), v1::GUARD_FAULT_NONE);
    EXPECT_TRUE(fs::exists(marker));
    first.signal(SIGKILL);
    EXPECT_EQ(first.wait(), -SIGKILL);
  }
  {  // ends before anyone has cleared: the next one must not forget
    DaemonProcess second(kPlainService);
    EXPECT_EQ(latched_by(ServiceClient(connect(second.await_address()))), v1::GUARD_FAULT_UNCLEAN_END);
    second.end();
    EXPECT_NE(second.errors().find("did not end cleanly"), std::string::npos) << second.errors();
    EXPECT_TRUE(fs::exists(marker));
  }
  {
    DaemonProcess third(kPlainService);
    const ServiceClient client(connect(third.await_address()));
    EXPECT_EQ(latched_by(client), v1::GUARD_FAULT_UNCLEAN_END);
    const v1::ClearResponse cleared = answer_of(*client.safety, &v1::SafetyService::Stub::Clear);
    EXPECT_EQ(cleared.cleared_fault(), v1::GUARD_FAULT_UNCLEAN_END);
    third.end();
    EXPECT_FALSE(fs::exists(marker));
  }
  DaemonProcess fourth(kPlainService);
  EXPECT_EQ(latched_by(ServiceClient(connect(fourth.await_address()))), v1::GUARD_FAULT_NONE);
}

TEST(AfterACrash, AStateFolderThatCannotBeWrittenIsNamed) {
  const EnvironmentVariable folder("STATE_DIRECTORY", "/proc/self");
  DaemonProcess daemon({"--listen", "127.0.0.1:0", "--model-store", ":memory:"});
  EXPECT_EQ(daemon.wait(), 2);
  EXPECT_NE(daemon.errors().find("/proc/self/running"), std::string::npos) << daemon.errors();
}

TEST(Files, AreForItsUserAndGroupHoweverItWasStarted) {
  const mode_t before = umask(0);
  const TemporaryFolder folder;
  DaemonProcess daemon({"--listen", "127.0.0.1:0", "--model-store", folder.path("state/models.sqlite")});
  umask(before);
  const ServiceClient client(connect(daemon.await_address()));
  client.await([](const v1::RigState& s) { return s.tick() > 10; });
  const auto others = fs::perms::others_all | fs::perms::group_write;
  int seen = 0;
  for (const auto& entry : fs::recursive_directory_iterator(folder.path("state"))) {
    if (!entry.is_regular_file() && !entry.is_directory()) continue;
    EXPECT_EQ(entry.status().permissions() & others, fs::perms::none) << entry.path();
    ++seen;
  }
  EXPECT_GT(seen, 2);
  daemon.end();
}

TEST(Memory, TheDaemonStaysSmall) {
  if (kSanitized) GTEST_SKIP() << "its memory is the sanitizer's";
  DaemonProcess daemon(kPlainService);
  const ServiceClient client(connect(daemon.await_address()));
  client.await([](const v1::RigState& s) { return s.tick() > 200; });
  EXPECT_LT(resident_mb(daemon.pid()), 100.0);
  const auto exchange = [&client](int times) {
    for (int i = 0; i < times; ++i) {
      ASSERT_TRUE(client.load("explore_rod").ok());
      ASSERT_TRUE(client.load("tap_1d").ok());
    }
  };
  exchange(10);
  const double before_mb = resident_mb(daemon.pid());
  exchange(40);
  EXPECT_LT(resident_mb(daemon.pid()) - before_mb, 8.0) << "of " << before_mb << " MB";
  EXPECT_LT(resident_mb(daemon.pid()), 100.0);
}

}  // namespace
}  // namespace hapticd::test
