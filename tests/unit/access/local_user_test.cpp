#include "server/access/local_user.h"

#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include "server/access/connected_users.h"

namespace hapticd::server {
namespace {

/// A connection within this machine; `served` is the end of the one who accepted.
struct Pair {
  Pair() {
    const int listening = socket(AF_INET, SOCK_STREAM, 0);
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    socklen_t length = sizeof address;
    EXPECT_EQ(bind(listening, reinterpret_cast<sockaddr*>(&address), length), 0);
    EXPECT_EQ(listen(listening, 1), 0);
    getsockname(listening, reinterpret_cast<sockaddr*>(&address), &length);
    client = socket(AF_INET, SOCK_STREAM, 0);
    EXPECT_EQ(connect(client, reinterpret_cast<sockaddr*>(&address), length), 0);
    served = accept(listening, nullptr, nullptr);
    length = sizeof address;
    getsockname(client, reinterpret_cast<sockaddr*>(&address), &length);
    peer = "ipv4:127.0.0.1:" + std::to_string(ntohs(address.sin_port));
    close(listening);
  }
  ~Pair() {
    close(client);
    close(served);
  }
  int client = -1;
  int served = -1;
  std::string peer;
};

TEST(LocalUser, IsTheOneWhoMadeTheOtherEndOfAConnection) {
  const Pair pair;
  const auto user = user_of_loopback_peer(pair.served);
  if (!user) GTEST_SKIP() << "this kernel does not say (no sock_diag)";
  EXPECT_EQ(*user, getuid());
}

TEST(LocalUser, IsUnknownOfWhatIsNoConnection) {
  EXPECT_FALSE(user_of_loopback_peer(-1));
  const int unconnected = socket(AF_INET, SOCK_STREAM, 0);
  EXPECT_FALSE(user_of_loopback_peer(unconnected));
  close(unconnected);
}

TEST(ConnectedUsers, FindTheUserByTheAddressThatGrpcShows) {
  const Pair pair;
  ConnectedUsers users;
  EXPECT_TRUE(users.find(pair.peer).name.empty()) << "not noted yet";
  users.note(pair.served);
  if (!user_of_loopback_peer(pair.served)) GTEST_SKIP() << "this kernel does not say (no sock_diag)";
  EXPECT_EQ(users.find(pair.peer).name, user_of_id(getuid()).name);
  EXPECT_TRUE(users.find("ipv4:127.0.0.1:1").name.empty());
}

}  // namespace
}  // namespace hapticd::server
