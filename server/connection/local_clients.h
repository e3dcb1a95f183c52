#pragma once

#include <chrono>
#include <map>
#include <string>

#include "server/access/identity.h"
#include "server/access/local_user.h"

namespace hapticd::server {

class RolePolicy;

/// Address of a connection's other end: "ipv4:127.0.0.1:40712", "ipv6:[::1]:40712", "unix:"; empty if there
/// is none.
std::string address_of_peer(int descriptor);

/// Finds the user who connects within this machine, asked of the kernel when the connection is accepted:
/// before its address can be used again, and before it can be closed without a trace. One thread.
class LocalClients {
 public:
  /// `unix_group`: may open the unix socket.
  LocalClients(const RolePolicy& policy, std::string unix_group);

  Identity identify(int descriptor, ConnectionKind kind);

 private:
  static constexpr std::chrono::seconds kKept{60};
  LocalUser look_up(unsigned id);

  const RolePolicy& policy_;
  const std::string unix_group_;
  PeerLookup lookup_;
  std::map<unsigned, LocalUser> known_;
  std::chrono::steady_clock::time_point forget_at_{};
};

}  // namespace hapticd::server
