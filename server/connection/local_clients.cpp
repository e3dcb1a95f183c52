#include "server/connection/local_clients.h"

#include <arpa/inet.h>
#include <netinet/in.h>
#include <sys/socket.h>

#include <array>
#include <optional>
#include <utility>

#include "server/access/role_policy.h"

namespace hapticd::server {

std::string address_of_peer(int descriptor) {
  sockaddr_storage peer{};
  socklen_t length = sizeof peer;
  if (getpeername(descriptor, reinterpret_cast<sockaddr*>(&peer), &length) != 0) return {};
  std::array<char, INET6_ADDRSTRLEN> text{};
  if (peer.ss_family == AF_INET) {
    const auto& v4 = reinterpret_cast<const sockaddr_in&>(peer);
    inet_ntop(AF_INET, &v4.sin_addr, text.data(), text.size());
    return std::string("ipv4:") + text.data() + ":" + std::to_string(ntohs(v4.sin_port));
  }
  if (peer.ss_family == AF_INET6) {
    const auto& v6 = reinterpret_cast<const sockaddr_in6&>(peer);
    inet_ntop(AF_INET6, &v6.sin6_addr, text.data(), text.size());
    return std::string("ipv6:[") + text.data() + "]:" + std::to_string(ntohs(v6.sin6_port));
  }
  return peer.ss_family == AF_UNIX ? "unix:" : "";
}

LocalClients::LocalClients(const RolePolicy& policy, std::string unix_group)
    : policy_(policy), unix_group_(std::move(unix_group)) {}

Identity LocalClients::identify(int descriptor, ConnectionKind kind) {
  const bool is_unix = kind == ConnectionKind::kUnixSocket || kind == ConnectionKind::kConsole;
  const std::optional<unsigned> id =
      is_unix ? PeerLookup::user_of_unix_peer(descriptor) : lookup_.user_of_loopback_peer(descriptor);
  const LocalUser user = id ? look_up(*id) : LocalUser{};
  Identity who = is_unix ? policy_.of_unix_user(user, unix_group_) : policy_.of_user(user);
  who.is_console = kind == ConnectionKind::kConsole;
  who.peer = address_of_peer(descriptor);
  return who;
}

// Looks up a user once: the names may be those of a directory in the network, and asking for each connection
// would take too long.
LocalUser LocalClients::look_up(unsigned id) {
  const auto now = std::chrono::steady_clock::now();
  if (now >= forget_at_) {
    known_.clear();
    forget_at_ = now + kKept;
  }
  const auto known = known_.find(id);
  if (known != known_.end()) return known->second;
  return known_.emplace(id, user_of_id(id)).first->second;
}

}  // namespace hapticd::server
