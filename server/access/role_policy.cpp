#include "server/access/role_policy.h"

#include <algorithm>

namespace hapticd::server {

namespace {

constexpr std::string_view kScheme = "spiffe://";
constexpr std::string_view kSerial = "serial:";

std::optional<Role> role_of(std::string_view word) {
  for (const Role role : {Role::kObserver, Role::kOperator, Role::kMaintainer, Role::kConsole}) {
    if (to_text(role) == word) return role;
  }
  return std::nullopt;
}

}  // namespace

std::string_view to_text(Role role) {
  switch (role) {
    case Role::kNone:
      return "none";
    case Role::kObserver:
      return "observer";
    case Role::kOperator:
      return "operator";
    case Role::kMaintainer:
      return "maintainer";
    case Role::kConsole:
      return "console";
  }
  return "";
}

std::optional<CertificateName> parse_certificate_name(std::string_view uri) {
  if (!uri.starts_with(kScheme)) return std::nullopt;
  uri.remove_prefix(kScheme.size());
  std::vector<std::string_view> parts;
  for (;;) {
    const std::size_t slash = uri.find('/');
    parts.push_back(uri.substr(0, slash));
    if (slash == std::string_view::npos) break;
    uri.remove_prefix(slash + 1);
  }
  const bool complete = parts.size() == 4 && parts[1] == "hapticd" &&
                        std::none_of(parts.begin(), parts.end(), [](auto part) { return part.empty(); });
  if (!complete) return std::nullopt;
  const auto role = role_of(parts[2]);
  if (!role) return std::nullopt;
  return CertificateName{std::string(parts[0]), *role, std::string(parts[3])};
}

void RolePolicy::deny(Identity& identity, const std::string& also) const {
  for (const std::string& name : {identity.name, also}) {
    const auto denied = config_.denied.find(name);
    if (denied == config_.denied.end()) continue;
    identity.is_denied = true;
    identity.denied_why = denied->second;
  }
}

Identity RolePolicy::of_local(const LocalUser& user, ConnectionKind kind) const {
  Identity identity;
  identity.connection = kind;
  identity.name = user.name.empty() ? "local" : "user:" + user.name;
  identity.role = config_.local_role;
  identity.role_source = "[access] local_role";
  if (user.name.empty()) {
    if (!config_.users.empty() || !config_.groups.empty() || !config_.denied.empty()) {
      identity.is_denied = true;
      identity.denied_why = "the kernel does not show which user this is, and [access] names some";
    }
    return identity;
  }
  const auto named = config_.users.find(user.name);
  if (named != config_.users.end()) {
    identity.role = named->second;
    identity.role_source = "[access.users]";
    return identity;
  }
  bool in_a_group = false;
  for (const std::string& group : user.groups) {
    const auto found = config_.groups.find(group);
    if (found == config_.groups.end() || (in_a_group && found->second <= identity.role)) continue;
    in_a_group = true;
    identity.role = found->second;
    identity.role_source = "[access.groups] " + group;
  }
  return identity;
}

Identity RolePolicy::of_user(const LocalUser& user) const {
  Identity identity = of_local(user, ConnectionKind::kLoopback);
  deny(identity);
  return identity;
}

Identity RolePolicy::of_unix_user(const LocalUser& user, const std::string& group) const {
  LocalUser with_group = user;
  with_group.groups.push_back(group);
  Identity identity = of_local(with_group, ConnectionKind::kUnixSocket);
  deny(identity, "unix:" + group);
  return identity;
}

Identity RolePolicy::of_certificate(const std::string& uri, const std::string& serial) const {
  Identity identity;
  identity.connection = ConnectionKind::kTls;
  identity.name = uri;
  identity.role_source = "certificate";
  if (const auto name = parse_certificate_name(uri)) {
    const bool is_ours = config_.lab.empty() || name->lab == config_.lab;
    identity.is_console = is_ours && name->role == Role::kConsole;
    if (is_ours && !identity.is_console) identity.role = name->role;
    if (!is_ours) identity.role_source = "certificate of the lab " + name->lab + ", not of " + config_.lab;
  }
  if (const auto found = config_.certificates.find(uri); found != config_.certificates.end()) {
    identity.role = found->second;
    identity.role_source = "[access.certificates]";
  }
  deny(identity, std::string(kSerial) + serial);
  return identity;
}

LeaseRule RolePolicy::lease_rule(const Identity& identity) const {
  if (config_.lease != LeaseRule::kByConnection) return config_.lease;
  return identity.is_remote() ? LeaseRule::kRequired : LeaseRule::kWhenTaken;
}

}  // namespace hapticd::server
