#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "server/access/local_user.h"
#include "server/connection/connection_listener.h"
#include "server/stop/stop_message.h"
#include "server/stop/stop_server.h"
#include "tests/support/eventually.h"
#include "tests/support/temporary_folder.h"

namespace hapticd::server {
namespace {

constexpr std::uint64_t kTick = 123'456;
const std::string kStopped = "HAPTICD STOPPED 000000000001e240\n";
const std::string kRefused = "HAPTICD REFUSED 0000000000000000\n";

/// A stop server without a daemon.
class Stops {
 public:
  explicit Stops(AccessConfig access = {}) : policy_(std::move(access)) {
    listener_ =
        std::move(*ConnectionListener::open({ListenAddress{"127.0.0.1", 0}, path(), "", std::nullopt, {}}));
    StopServer::Parts parts{.sockets = listener_->take_stop_sockets(),
                            .rights = StopRights(policy_, listener_->unix_group()),
                            .stop =
                                [this] {
                                  ++stopped;
                                  return kTick;
                                },
                            .report =
                                [this](const StopReport& report, std::uint64_t) {
                                  const std::lock_guard lock(mutex_);
                                  reports_.push_back(report);
                                }};
    server_ = std::move(*StopServer::start(std::move(parts)));
  }
  std::string path() const { return folder_.path("hapticd.sock"); }
  std::vector<StopReport> await_reports(std::size_t count) {
    std::vector<StopReport> seen;
    test::eventually([&] {
      const std::lock_guard lock(mutex_);
      seen = reports_;
      return seen.size() >= count;
    });
    return seen;
  }
  int connect() const {
    const int descriptor = socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
    connect(descriptor);
    return descriptor;
  }
  void connect(int descriptor) const {
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    address.sin_port = htons(static_cast<std::uint16_t>(listener_->port() + 1));
    EXPECT_EQ(::connect(descriptor, reinterpret_cast<const sockaddr*>(&address), sizeof address), 0);
  }
  /// What a connection is answered; empty: it was closed.
  static std::string say(int descriptor, const std::string& words) {
    send(descriptor, words.data(), words.size(), MSG_NOSIGNAL);
    std::string answer;
    std::array<char, 64> part{};
    for (ssize_t n = 0; (n = recv(descriptor, part.data(), part.size(), 0)) > 0;)
      answer.append(part.data(), static_cast<std::size_t>(n));
    return answer;
  }
  std::string say_by_port(const std::string& words) const {
    const int descriptor = connect();
    const std::string answer = say(descriptor, words);
    close(descriptor);
    return answer;
  }
  std::string say_by_datagram(const std::string& words) const {
    const std::string socket_path = path() + ".stop";
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    std::memcpy(address.sun_path, socket_path.c_str(), socket_path.size() + 1);
    const int descriptor = socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC, 0);
    const sockaddr_un any{.sun_family = AF_UNIX, .sun_path = {}};
    bind(descriptor, reinterpret_cast<const sockaddr*>(&any), sizeof(sa_family_t));
    sendto(descriptor, words.data(), words.size(), 0, reinterpret_cast<const sockaddr*>(&address),
           sizeof address);
    std::array<char, 64> answer{};
    const ssize_t size = recv(descriptor, answer.data(), answer.size(), 0);
    close(descriptor);
    return {answer.data(), static_cast<std::size_t>(size > 0 ? size : 0)};
  }

  std::atomic<int> stopped{0};

 private:
  test::TemporaryFolder folder_;
  RolePolicy policy_;
  std::unique_ptr<ConnectionListener> listener_;
  std::mutex mutex_;
  std::vector<StopReport> reports_;
  std::unique_ptr<StopServer> server_;
};

std::string my_name() {
  return user_of_id(getuid()).name;
}

TEST(StopServer, TakesNoOtherFileForASocketLeftBehind) {
  const test::TemporaryFolder folder;
  const std::string path = folder.path("hapticd.sock.stop");
  std::ofstream(path) << "mine";
  const auto listener = ConnectionListener::open(
      {ListenAddress{"127.0.0.1", 0}, folder.path("hapticd.sock"), "", std::nullopt, {}});
  ASSERT_FALSE(listener);
  EXPECT_EQ(listener.error().where, path);
  EXPECT_TRUE(std::filesystem::exists(path));
}

TEST(StopServer, StopsByTheNextPortAndByADatagram) {
  Stops stops;
  EXPECT_EQ(stops.say_by_port(std::string(kStopRequest)), kStopped);
  EXPECT_EQ(stops.stopped, 1);
  EXPECT_EQ(stops.say_by_datagram(std::string(kStopRequest)), kStopped);
  EXPECT_EQ(stops.stopped, 2);
  const auto reports = stops.await_reports(2);
  ASSERT_EQ(reports.size(), 2U);
  EXPECT_EQ(reports[0].path, StopPath::kLoopback);
  EXPECT_EQ(std::string(reports[0].peer.data()).substr(0, 15), "ipv4:127.0.0.1:");
  EXPECT_EQ(reports[1].path, StopPath::kDatagram);
  EXPECT_EQ(reports[1].process, getpid());
  for (const StopReport& report : reports) {
    EXPECT_TRUE(report.has_user);
    EXPECT_EQ(report.user, getuid());
    EXPECT_EQ(report.last_tick, kTick);
  }
}

/// A sender whose name is a link to the socket itself made the daemon answer, and stop, itself for ever.
TEST(StopServer, TakesItsOwnAnswerForNoRequest) {
  Stops stops;
  const std::string socket_path = stops.path() + ".stop";
  sockaddr_un name{.sun_family = AF_UNIX, .sun_path = {}};
  sockaddr_un to = name;
  const std::string own_path = stops.path() + ".own";
  std::memcpy(name.sun_path, own_path.c_str(), own_path.size() + 1);
  std::memcpy(to.sun_path, socket_path.c_str(), socket_path.size() + 1);
  const int descriptor = socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC, 0);
  ASSERT_EQ(bind(descriptor, reinterpret_cast<const sockaddr*>(&name), sizeof name), 0);
  ASSERT_EQ(unlink(own_path.c_str()), 0);
  ASSERT_EQ(symlink(socket_path.c_str(), own_path.c_str()), 0);
  ASSERT_EQ(sendto(descriptor, "x", 1, 0, reinterpret_cast<const sockaddr*>(&to), sizeof to), 1);
  close(descriptor);
  ASSERT_EQ(stops.await_reports(1).size(), 1U);
  EXPECT_EQ(stops.say_by_datagram("x"), kStopped) << "behind its own answer in the queue";
  EXPECT_EQ(stops.say_by_datagram("x"), kStopped);
  EXPECT_EQ(stops.stopped, 3);
}

TEST(StopServer, StopsWhateverFollowsTheWords) {
  Stops stops;
  for (const std::string& words :
       {std::string("HAPTICD STOP"), std::string("HAPTICD STOP 7 now"),
        "HAPTICD STOP" + std::string(30, '\xff'), std::string(kStopRequest) + std::string(5'000'000, 'x')}) {
    const int before = stops.stopped;
    const int descriptor = stops.connect();
    send(descriptor, words.data(), words.size(), MSG_NOSIGNAL);  // it may be closed before all is taken
    EXPECT_TRUE(test::eventually([&] { return stops.stopped == before + 1; })) << words.substr(0, 20);
    close(descriptor);
  }
  for (const std::string& words : {std::string("?"), std::string(60, '\0'), std::string(50'000, 'x')}) {
    EXPECT_EQ(stops.say_by_datagram(words), kStopped) << "every datagram";
  }
}

TEST(StopServer, TakesNoOtherProtocolForAStop) {
  Stops stops;
  for (const char* words : {"GET / HTTP/1.1\r\n\r\n", "PRI * HTTP/2.0\r\n\r\n", "\x16\x03\x01\x02",
                            "HAPTICD GO", "hapticd stop"}) {
    EXPECT_EQ(stops.say_by_port(words), kRefused) << words;
  }
  EXPECT_EQ(stops.stopped, 0);
}

TEST(StopServer, RefusesTheDenied) {
  AccessConfig access;
  access.denied["user:" + my_name()] = "left the lab";
  Stops stops(access);
  EXPECT_EQ(stops.say_by_port(std::string(kStopRequest)), kRefused);
  EXPECT_EQ(stops.say_by_datagram(std::string(kStopRequest)), kRefused);
  EXPECT_EQ(stops.stopped, 0);
  EXPECT_TRUE(stops.await_reports(2)[1].was_refused);
}

TEST(StopServer, AnUnknownUserGainsNothingByBeingUnknown) {
  const RolePolicy open{AccessConfig{}};
  EXPECT_TRUE(StopRights(open, "haptics").user_may_stop(std::nullopt));
  AccessConfig access;
  access.denied["user:" + my_name()] = "left the lab";
  const RolePolicy closed{access};
  EXPECT_FALSE(StopRights(closed, "haptics").user_may_stop(std::nullopt));
  AccessConfig group;
  group.denied["unix:haptics"] = "they left";
  const RolePolicy without_group{group};
  EXPECT_FALSE(StopRights(without_group, "haptics").unix_user_may_stop(getuid()));
  EXPECT_TRUE(StopRights(without_group, "haptics").user_may_stop(getuid()));
}

TEST(StopServer, NoOneCanHoldTheLastPlace) {
  Stops stops;
  std::vector<int> held;
  for (int i = 0; i < 300; ++i) held.push_back(stops.connect());
  for (int i = 0; i < 20; ++i) EXPECT_EQ(stops.say_by_port(std::string(kStopRequest)), kStopped) << i;
  for (const int descriptor : held) close(descriptor);
}

TEST(StopServer, ServesAStopWhenNoDescriptorIsLeft) {
  Stops stops;
  for (const int idle : {0, 3}) {  // with nothing, and with something that can make room
    std::vector<int> held;
    for (int i = 0; i < idle; ++i) held.push_back(stops.connect());
    // A stop is served after those that came before it.
    EXPECT_EQ(stops.say_by_port(std::string(kStopRequest)), kStopped);
    rlimit usual{};
    ASSERT_EQ(getrlimit(RLIMIT_NOFILE, &usual), 0);
    ASSERT_GT(usual.rlim_cur, 600U);
    // poll() takes no more places than the process may have descriptors.
    while (held.empty() || held.back() < 512) held.push_back(dup(STDERR_FILENO));
    const int descriptor = socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
    rlimit none_left = usual;
    none_left.rlim_cur = static_cast<rlim_t>(descriptor) + 1;  // the kernel gives the lowest that is free
    ASSERT_EQ(setrlimit(RLIMIT_NOFILE, &none_left), 0);
    stops.connect(descriptor);
    EXPECT_EQ(Stops::say(descriptor, std::string(kStopRequest)), kStopped);
    ASSERT_EQ(setrlimit(RLIMIT_NOFILE, &usual), 0);
    close(descriptor);
    for (const int one : held) close(one);
  }
}

TEST(StopServer, ComesInPiecesAndIsClosedWhenItDoesNotCome) {
  Stops stops;
  const int slow = stops.connect();
  for (const char c : std::string("HAPTICD STO")) send(slow, &c, 1, MSG_NOSIGNAL);
  EXPECT_EQ(Stops::say(slow, "P"), kStopped);
  close(slow);
  const int silent = stops.connect();
  EXPECT_EQ(Stops::say(silent, "HAPTICD"), "") << "closed after its time";
  close(silent);
  EXPECT_EQ(stops.stopped, 1);
}

}  // namespace
}  // namespace hapticd::server
