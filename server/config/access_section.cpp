#include "server/config/access_section.h"

#include <optional>
#include <string>

#include "server/config/config_words.h"
#include "server/config/identity_text.h"
#include "server/text/toml_writer.h"

namespace hapticd::server {

namespace {

constexpr Range kNoticeS{0.0, 10.0, "s"};
constexpr Range kCalls{16.0, 10'000.0, "calls"};
constexpr Range kCallsPerS{10.0, 1e6, "calls/s"};
constexpr Range kFileMb{0.1, 1000.0, "MB"};

/// The key in the spelling that is compared; refuses a line that could never apply to anyone.
template <class Spell>
std::optional<std::string> spelled(TomlTable& table, const std::string& key, const std::string& place,
                                   Spell spell) {
  const hal::Result<std::string> known = spell(key, "'" + place + key + "'");
  if (known) return *known;
  table.wants(key);
  table.refuse(key, known.error());
  return std::nullopt;
}

template <class Spell>
void read_roles(TomlTable table, const char* place, Spell spell, std::map<std::string, Role>& roles) {
  for (const std::string& key : table.keys()) {
    const auto name = spelled(table, key, place, spell);
    if (name) table.read(key, roles[*name] = Role::kNone, kRoleWords);
  }
}

void write_roles(TomlWriter table, const std::map<std::string, Role>& roles) {
  for (const auto& [name, role] : roles) table.field(toml_quoted(name), role, kRoleWords);
}

void access_fields(auto& table, auto& access) {
  table.field("lease", access.lease, kLeaseWords);
  table.field("take_notice_s", access.take_notice_s, kNoticeS);
  table.field("local_role", access.local_role, kRoleWords);
  table.field("lab", access.lab, 200);
  table.field("unix_socket_group", access.unix_socket_group, 64);
  table.field("max_calls", access.max_calls, kCalls);
  table.field("max_calls_per_s", access.max_calls_per_s, kCallsPerS);
  table.field("audit_file", access.audit_file, 4096);
  table.field("audit_file_mb", access.audit_file_mb, kFileMb);
  table.field("audit_journal", access.audit_journal);
}

}  // namespace

void read_access(TomlTable table, AccessConfig& access) {
  access_fields(table, access);
  read_roles(table.table("users"), "access.users.", local_name, access.users);
  read_roles(table.table("groups"), "access.groups.", local_name, access.groups);
  read_roles(table.table("certificates"), "access.certificates.", certificate_uri, access.certificates);
  TomlTable denied = table.table("denied");
  for (const std::string& key : denied.keys()) {
    const auto identity = spelled(denied, key, "access.denied.", denied_identity);
    if (identity) denied.read(key, access.denied[*identity], 200);
  }
}

std::string write_access(const AccessConfig& access) {
  return toml_fields([&](TomlWriter& root) {
    TomlWriter table = root.table("access");
    access_fields(table, access);
    write_roles(table.table("users"), access.users);
    write_roles(table.table("groups"), access.groups);
    write_roles(table.table("certificates"), access.certificates);
    TomlWriter denied = table.table("denied");
    for (const auto& [identity, why] : access.denied) denied.field(toml_quoted(identity), why);
  });
}

}  // namespace hapticd::server
