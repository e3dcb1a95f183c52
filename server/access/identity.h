#pragma once

#include <cstdint>
#include <string>

#include "server/config/access_config.h"

namespace hapticd::server {

/// Kind of connection by which a client comes.
enum class ConnectionKind : std::uint8_t {
  kLoopback,
  kUnixSocket,
  kTls,
  kConsole,  ///< the unix socket, by a user whose programs may be consoles
};

/// Identity of a client, by the transport of its connection. Only a console can name another one
/// (AccessGate).
struct Identity {
  /// "user:anna" of this machine, "local" if the user could not be found out,
  /// "spiffe://LAB/hapticd/ROLE/NAME" of a certificate.
  std::string name;
  ConnectionKind connection = ConnectionKind::kLoopback;
  std::string peer;  ///< address: "ipv4:127.0.0.1:40712", "unix:"
  Role role = Role::kNone;
  std::string role_source;  ///< where the role is from, e.g. "certificate"
  /// May make calls on behalf of others: a certificate of the role console, or the unix socket and a user
  /// that [console] names.
  bool is_console = false;
  bool is_denied = false;
  std::string denied_why;

  bool is_remote() const { return connection == ConnectionKind::kTls; }
};

}  // namespace hapticd::server
