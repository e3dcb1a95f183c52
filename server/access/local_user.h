#pragma once

#include <optional>
#include <string>

#include "server/access/role_policy.h"

namespace hapticd::server {

/// Asks the kernel for the users behind connections (sock_diag, SO_PEERCRED). Holds one descriptor, so that
/// it can ask when no other is left. One thread.
class PeerLookup {
 public:
  PeerLookup();
  ~PeerLookup();
  PeerLookup(const PeerLookup&) = delete;
  PeerLookup& operator=(const PeerLookup&) = delete;

  /// The user who made the other end of a TCP connection within this machine. Unknown if the kernel does not
  /// say, e.g. because that end is closed already.
  std::optional<unsigned> user_of_loopback_peer(int descriptor);
  /// The user who connected to a unix socket.
  static std::optional<unsigned> user_of_unix_peer(int descriptor);

 private:
  int channel_;
  unsigned asked_ = 0;  ///< number of the last question
};

/// Name and groups of a user; the name is the number if it has none.
LocalUser user_of_id(unsigned id);
/// Number of a user; nothing if there is no such user or group.
std::optional<unsigned> user_id(const std::string& name);
std::optional<unsigned> group_id(const std::string& name);
/// The group's name, or its number.
std::string group_name(unsigned id);

}  // namespace hapticd::server
