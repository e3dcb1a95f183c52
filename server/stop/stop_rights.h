#pragma once

#include <optional>
#include <string>
#include <vector>

#include "server/access/role_policy.h"

namespace hapticd::server {

/// Rights to stop without gRPC: all clients that are not on the deny list have them. Its users are looked up
/// once, at the start: the thread that serves a stop asks no directory, which may be in the network.
class StopRights {
 public:
  /// `unix_group`: may open the unix socket. `policy` must outlive it.
  StopRights(const RolePolicy& policy, const std::string& unix_group);

  /// True if a user of this machine may stop; nothing: not known, which is refused if any user is denied.
  /// Takes no memory.
  bool user_may_stop(std::optional<unsigned> user) const noexcept;
  /// True if a user may stop beside the unix socket, of which the whole group may be denied.
  bool unix_user_may_stop(std::optional<unsigned> user) const noexcept;
  bool certificate_may_stop(const std::string& uri, const std::string& serial) const;

 private:
  const RolePolicy& policy_;
  bool denies_users_ = false;
  bool denies_unix_group_ = false;
  std::vector<unsigned> denied_;
};

}  // namespace hapticd::server
