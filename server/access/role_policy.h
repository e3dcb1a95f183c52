#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "server/access/identity.h"

namespace hapticd::server {

/// The parts of "spiffe://LAB/hapticd/ROLE/NAME".
struct CertificateName {
  std::string lab;
  Role role = Role::kNone;
  std::string name;
};
/// Reads a name; nothing if the text is not such a name.
std::optional<CertificateName> parse_certificate_name(std::string_view uri);

/// A user of this machine.
struct LocalUser {
  std::string name;                 ///< empty: not known
  std::vector<std::string> groups;  ///< by name
};

/// Finds the identity and its role by what a connection shows, by the configuration. If several lines name a
/// user, the one of the user counts before those of its groups, and of its groups the highest role.
class RolePolicy {
 public:
  explicit RolePolicy(AccessConfig config) : config_(std::move(config)) {}

  /// Identity of a user over loopback. One that is not known has the local_role, but is refused as soon as
  /// [access] names any user or group, or denies anyone: otherwise a user who is named could choose to be
  /// unknown.
  Identity of_user(const LocalUser& user) const;
  /// Identity of a user over the unix socket, which only `group` may open: a line of it counts as one of the
  /// user's own.
  Identity of_unix_user(const LocalUser& user, const std::string& group) const;
  /// `uri`: of the client's certificate, empty if it has none; `serial` in hexadecimal digits. The role that
  /// it names counts only if it names the lab of this daemon ([access] lab).
  Identity of_certificate(const std::string& uri, const std::string& serial) const;

  LeaseRule lease_rule(const Identity& identity) const;
  const AccessConfig& config() const { return config_; }

 private:
  Identity of_local(const LocalUser& user, ConnectionKind kind) const;
  void deny(Identity& identity, const std::string& also = {}) const;
  AccessConfig config_;
};

std::string_view to_text(Role role);

}  // namespace hapticd::server
