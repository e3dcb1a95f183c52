#pragma once

#include <cstdint>
#include <string>

#include "server/config/access_config.h"

namespace hapticd::server {

/// Where a client comes from.
enum class ConnectionKind : std::uint8_t { kLoopback, kUnixSocket, kTls };

/// Who a client is, by the transport of its connection; nothing in a message can change it.
struct Identity {
  /// "user:anna" and "local" (a user that could not be found out) over loopback, "unix:GROUP" over the unix
  /// socket, "spiffe://LAB/hapticd/ROLE/NAME" of a certificate.
  std::string name;
  ConnectionKind connection = ConnectionKind::kLoopback;
  std::string peer;  ///< address, as gRPC names it
  Role role = Role::kNone;
  std::string role_source;  ///< where the role is from, e.g. "certificate"
  bool is_denied = false;
  std::string denied_why;

  bool is_remote() const { return connection == ConnectionKind::kTls; }
};

}  // namespace hapticd::server
