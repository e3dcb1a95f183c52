#include "server/access/local_user.h"

#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include "server/access/unknown_names.h"

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
    close(listening);
  }
  ~Pair() {
    close(client);
    close(served);
  }
  int client = -1;
  int served = -1;
};

TEST(LocalUser, IsTheOneWhoMadeTheOtherEndOfAConnection) {
  const Pair pair;
  PeerLookup lookup;
  const auto user = lookup.user_of_loopback_peer(pair.served);
  if (!user) GTEST_SKIP() << "this kernel does not say (no sock_diag)";
  EXPECT_EQ(*user, getuid());
}

TEST(LocalUser, IsUnknownOfWhatIsNoConnection) {
  PeerLookup lookup;
  EXPECT_FALSE(lookup.user_of_loopback_peer(-1));
  const int unconnected = socket(AF_INET, SOCK_STREAM, 0);
  EXPECT_FALSE(lookup.user_of_loopback_peer(unconnected));
  close(unconnected);
}

TEST(LocalUser, IsTheOneWhoConnectedToAUnixSocket) {
  int pair[2];
  ASSERT_EQ(socketpair(AF_UNIX, SOCK_STREAM, 0, pair), 0);
  EXPECT_EQ(PeerLookup::user_of_unix_peer(pair[0]), getuid());
  close(pair[0]);
  close(pair[1]);
  EXPECT_FALSE(PeerLookup::user_of_unix_peer(-1));
}

TEST(LocalUser, HasANumber) {
  EXPECT_EQ(user_id(user_of_id(getuid()).name), getuid());
  EXPECT_FALSE(user_id("no such user"));
}

TEST(UnknownNames, AreThoseThatThisMachineDoesNotKnow) {
  AccessConfig access;
  access.users = {{"root", Role::kObserver}, {"no_such_user", Role::kObserver}, {"4711", Role::kObserver}};
  access.groups = {{"root", Role::kObserver}, {"no_such_group", Role::kObserver}};
  access.denied = {
      {"user:root", ""}, {"user:gone", ""}, {"unix:gone_too", ""}, {"serial:0A", ""}, {"local", ""}};
  EXPECT_EQ(unknown_names(access),
            (std::vector<std::string>{
                "[access.users] names a user that this machine does not know: no_such_user",
                "[access.groups] names a group that this machine does not know: no_such_group",
                "[access.denied] names a group that this machine does not know: gone_too",
                "[access.denied] names a user that this machine does not know: gone"}));
  EXPECT_TRUE(unknown_names(AccessConfig{}).empty());
  AccessConfig groups;
  groups.unix_socket_group = "root";
  groups.denied = {{"unix:root", ""}, {"unix:daemon", ""}};
  EXPECT_EQ(
      unknown_names(groups),
      std::vector<std::string>{"[access.denied] names a group other than unix_socket_group = \"root\", so it "
                               "denies no client: unix:daemon"});
}

}  // namespace
}  // namespace hapticd::server
