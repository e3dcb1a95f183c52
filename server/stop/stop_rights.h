#pragma once

#include <optional>
#include <string>
#include <vector>

#include "server/access/role_policy.h"

namespace hapticd::server {

/// Who may stop without gRPC: all who are not on the deny list. Its users are looked up once, at the start:
/// the thread that serves a stop asks no directory, which may be in the network.
class StopRights {
 public:
  /// `unix_group`: may open the unix socket. `policy` must outlive it.
  StopRights(const RolePolicy& policy, const std::string& unix_group);

  /// A user of this machine; nothing: not known, which is refused where any user is denied. Takes no memory.
  bool user_may_stop(std::optional<unsigned> user) const noexcept;
  /// The same beside the unix socket, of which the whole group may be denied.
  bool unix_user_may_stop(std::optional<unsigned> user) const noexcept;
  bool certificate_may_stop(const std::string& uri, const std::string& serial) const;

 private:
  const RolePolicy& policy_;
  bool denies_users_ = false;
  bool denies_unix_group_ = false;
  std::vector<unsigned> denied_;
};

}  // namespace hapticd::server
