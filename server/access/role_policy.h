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
/// Nothing where the text is no such name.
std::optional<CertificateName> parse_certificate_name(std::string_view uri);

/// A user of this machine.
struct LocalUser {
  std::string name;                 ///< empty: not known
  std::vector<std::string> groups;  ///< by name
};

/// From what a connection shows to an identity with its role, by the configuration. Where several lines name
/// a user, the one of the user counts before those of its groups, and of its groups the highest role.
class RolePolicy {
 public:
  explicit RolePolicy(AccessConfig config) : config_(std::move(config)) {}

  /// A user over loopback. One that is not known has the local_role, but is refused as soon as [access] names
  /// any user or group, or denies anyone: otherwise who is named could choose to be unknown.
  Identity of_user(const LocalUser& user) const;
  /// A user over the unix socket, which only `group` may open: a line of it counts as one of the user's own.
  Identity of_unix_user(const LocalUser& user, const std::string& group) const;
  /// `uri`: of the client's certificate, empty where it has none; `serial` in hexadecimal digits. The role
  /// that it names counts only where it names the lab of this daemon ([access] lab).
  Identity of_certificate(const std::string& uri, const std::string& serial) const;
  /// Whether any line of the deny list names a serial number: only then it has to be found out.
  bool denies_serials() const;

  LeaseRule lease_rule(const Identity& identity) const;
  const AccessConfig& config() const { return config_; }

 private:
  Identity of_local(const LocalUser& user, ConnectionKind kind) const;
  void deny(Identity& identity, const std::string& also = {}) const;
  AccessConfig config_;
};

std::string_view to_text(Role role);

}  // namespace hapticd::server
