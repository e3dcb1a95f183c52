#include "server/connection/connection_listener.h"

#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <future>
#include <vector>

#include "tests/support/temporary_folder.h"
#include "tests/support/value_of.h"

namespace hapticd::server {
namespace {

/// Connects, and says nothing.
void expect_connected(const sockaddr_storage& address, std::vector<int>& open) {
  open.push_back(socket(address.ss_family, SOCK_STREAM | SOCK_CLOEXEC, 0));
  EXPECT_EQ(connect(open.back(), reinterpret_cast<const sockaddr*>(&address), sizeof(sockaddr_un)), 0);
}

// A user who connected to the port without pause kept all others off the unix socket: it was looked at when
// nothing else waited any more.
TEST(ConnectionListener, NoAddressKeepsAnotherWaiting) {
  const test::TemporaryFolder folder;
  ConnectionListener::Endpoints endpoints;
  endpoints.loopback = {"127.0.0.1", 0};
  endpoints.unix_socket = folder.path("d.sock");
  const auto listener = test::value_of(ConnectionListener::open(endpoints));

  sockaddr_storage port{};
  auto& v4 = reinterpret_cast<sockaddr_in&>(port);
  v4.sin_family = AF_INET;
  v4.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  v4.sin_port = htons(listener->port());
  sockaddr_storage local{};
  auto& name = reinterpret_cast<sockaddr_un&>(local);
  name.sun_family = AF_UNIX;
  endpoints.unix_socket.copy(name.sun_path, sizeof name.sun_path - 1);
  std::vector<int> open;
  constexpr std::size_t kFlood = 60;
  for (std::size_t i = 0; i < kFlood; ++i) expect_connected(port, open);
  expect_connected(local, open);

  std::vector<ConnectionKind> came;
  std::promise<void> all_came;
  ConnectionListener::Takers takers;
  takers.take = [&](int descriptor, ConnectionKind kind) {
    close(descriptor);
    came.push_back(kind);
    if (came.size() == kFlood + 1) all_came.set_value();
  };
  takers.has_room = [](ConnectionKind) { return true; };
  listener->start(std::move(takers));
  ASSERT_EQ(all_came.get_future().wait_for(std::chrono::seconds(20)), std::future_status::ready);
  listener->stop();
  const auto found = std::find(came.begin(), came.end(), ConnectionKind::kUnixSocket);
  EXPECT_LT(found - came.begin(), 10);
  for (const int descriptor : open) close(descriptor);
}

}  // namespace
}  // namespace hapticd::server
